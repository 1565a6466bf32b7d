"""The `cdpr` command, made from the verbs that `commands` lists; nothing imports this package."""

import signal
import threading

if threading.current_thread() is threading.main_thread():
    # Ctrl-C while the command is imported ends it at once, and says nothing.
    _before = signal.signal(signal.SIGINT, signal.SIG_DFL)

from cdpr_drake.cli.app import main

if threading.current_thread() is threading.main_thread():
    signal.signal(signal.SIGINT, _before)

__all__ = ["main"]
