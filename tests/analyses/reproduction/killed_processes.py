"""Processes that are killed at a change of a folder, each change in turn."""

import multiprocessing
import os
import signal
import sys


def kill_at_change(folder, changes, number):
    """Has this process killed before one change of a folder.

    Args:
        folder: The folder.
        changes: Audit events of Python that count as changes.
        number: How many come before; None: it is never killed.
    """
    if number is None:
        return
    seen = []

    def kill_at(event, arguments):
        if event in changes and str(folder) in os.fsdecode(str(arguments[0])):
            seen.append(event)
            if len(seen) > number:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(kill_at)


def exit_code_of(work, *arguments):
    """Of a process that does some work: -SIGKILL where it was killed."""
    process = multiprocessing.get_context("fork").Process(target=work, args=arguments)
    process.start()
    process.join()
    return process.exitcode
