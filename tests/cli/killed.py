"""A command that is killed when it has kept some chunks of a sweep."""


def killed_after(chunks, setup):
    """The program of a command whose process is killed after so many chunks.

    Args:
        chunks: How many it keeps.
        setup: Lines that make the sweep small, before it starts.
    """
    return f"""
import os, signal, sys
from cdpr_drake.analyses.sweeps.folder import SweepFolder
from cdpr_drake.cli.app import main
{setup}
store, left = SweepFolder.store, list(range({chunks}))

def store_some(*arguments):
    store(*arguments)
    left.pop()
    if not left:
        os.kill(os.getpid(), signal.SIGKILL)

SweepFolder.store = store_some
if __name__ == "__main__":
    main(sys.argv[1:])
"""
