"""What commands say to people on stderr, apart from lines of progress.

A line of progress may come at any time on a busy machine. It has a mark; tests of commands read
what these have printed by `printed`, and what a process said by `messages`.
"""

from typing import NamedTuple

from cdpr_drake.cli.process import PROGRESS


class Printed(NamedTuple):
    """What was printed since the last look, without lines of progress."""

    out: str
    err: str


def messages(stderr):
    """What was said on stderr, without lines of progress."""
    return "".join(
        line for line in stderr.splitlines(keepends=True) if not line.startswith(PROGRESS)
    )


def printed(capsys):
    """What pytest has captured."""
    out, err = capsys.readouterr()
    return Printed(out, messages(err))
