"""A command as a process: how it is asked to stop, and what it starts while it is imported.

* `StopRequest`: Ctrl-C, and SIGTERM as batch systems and containers send it, as a polite request.
* `exit_with_parent`: a command that another program started ends with it, also where it was killed.
* `compile_ahead`: which kernels a command will need, so that other processes compile them while it
  starts, and that is told at once.
"""

from __future__ import annotations

import os
import signal
import stat
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import pairwise
from pathlib import Path
from types import FrameType

from cdpr_drake.kernel_cache.background import compile_in_background
from cdpr_drake.kernel_cache.kernel_list import missing_kernels, needed_kernels

INTERRUPTED = 130
"""Exit code of what Ctrl-C or SIGTERM ended, as shells have it for the former."""

INCOMPLETE = 3
"""Exit code where the data is complete and something that is made of it is missing."""

STUDY_FAILED = 5
"""Exit code of a reproduction of which a study failed; the report says which."""

SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""What asks to stop."""

STOPPING = "Stopping; what is finished is written; Ctrl-C again ends this now"
"""Answer to the first Ctrl-C where nothing else is said."""


class StopRequest:
    """Turns the first Ctrl-C or SIGTERM into a polite request; a second one ends the program."""

    def __init__(self, words: str = STOPPING) -> None:
        """Nothing was asked yet.

        Args:
            words: What the first Ctrl-C is answered with on stderr, at once: what is waited for,
                and what a second one does.
        """
        self.asked = False
        self._words = words

    def __call__(self) -> bool:
        """Whether to stop."""
        return self.asked

    def ask(self) -> None:
        """Asks to stop, as the first signal does."""
        self.asked = True

    def _ask(self, number: int, frame: FrameType | None) -> None:
        self.asked = True
        for each in SIGNALS:
            signal.signal(each, signal.default_int_handler)
        # Past Python's buffers, which what was interrupted may be writing to. On a terminal this
        # takes the line of a progress bar.
        with suppress(OSError):  # nobody reads it any more
            start = "\r\x1b[2K" if os.isatty(2) else ""
            os.write(2, f"{start}{self._words}\n".encode())

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Listens to Ctrl-C and SIGTERM inside the block."""
        before = {each: signal.signal(each, self._ask) for each in SIGNALS}
        try:
            yield
        finally:
            for each, handler in before.items():
                signal.signal(each, handler)


LIFELINE = "CDPR_LIFELINE"
"""Environment variable of the file descriptor of a pipe whose other end the program has that
started the command, and nobody else."""

LONGEST_END = 20.0
"""Time to put away what there is before it is ended in earnest, as the studio gives it [s]."""


def exit_with_parent() -> None:
    """Ends this process when who started it is gone, if the environment has a `LIFELINE`.

    First by SIGTERM, which commands take as a wish, then by SIGKILL, with all that it started.
    """
    words = os.environ.pop(LIFELINE, "")  # nobody that is started from here holds on to it
    if not words.isdecimal():
        return
    threading.Thread(target=_watch, args=[int(words)], daemon=True, name="lifeline").start()


def _watch(pipe: int) -> None:
    try:
        if not stat.S_ISFIFO(os.fstat(pipe).st_mode):
            return
        while os.read(pipe, 1):  # nothing is ever written: it returns at the end
            pass
    except OSError:
        return  # it is no pipe of ours
    main = threading.main_thread().ident
    assert main is not None
    signal.pthread_kill(main, signal.SIGTERM)  # there, so that a call that waits is interrupted
    time.sleep(LONGEST_END)
    if os.getpgid(0) == os.getpid():
        os.killpg(0, signal.SIGKILL)
    os.kill(os.getpid(), signal.SIGKILL)


DEFAULT = "acrobot_pbvs_taut"
"""The group of what `cdpr simulate` runs unasked; other scenarios need about the same."""

COMPILED = "acrobot_pbvs, compiled engine"

QUESTIONS = ("tension", "static", "workspace", "stability", "plan")
"""Commands with a group of their own, of the same name: what they need with their defaults."""

BROKEN = "workspace, dynamic-single-failure"
"""What `cdpr workspace` needs for the kind that simulates broken cables."""

GROUPS = (DEFAULT, COMPILED, *QUESTIONS, BROKEN)
"""All groups of the list."""

ROBOTS = Path(__file__).parents[1] / "models" / "robots"
"""A folder for each robot and mechanism that comes with the package."""

SIMULATIONS = ("simulate", "serve", "reactions", "studio")

PROGRESS = "progress: "
"""How a line of progress begins where there is no terminal, and no other line on stderr does."""

_expected = 0


def compile_ahead(words: Sequence[str]) -> int:
    """Starts processes that compile what a command line will need, before it imports Drake.

    Where most of it is missing, a line on stderr says so at once: the first use of a command may
    take many times as long as the second.

    Args:
        words: The command line after `cdpr`.

    Returns:
        How many were started: 0 where all is there, and for commands that need little.
    """
    global _expected
    command = next((word for word in words if not word.startswith("-")), "")
    groups = _groups(command, words)
    if not groups or _will_be_refused(command, words):
        return 0
    _expected = missing = missing_kernels(groups)
    if 2 * missing > len(needed_kernels(groups)):
        start = "" if sys.stderr.isatty() else PROGRESS
        said = f"first use of cdpr {command}: compiling up to {missing} kernels, which are kept"
        print(f"{start}{said}", file=sys.stderr)
    return compile_in_background(groups)


def expected_kernels() -> int:
    """How many kernels were missing when the command began, of those that it is listed with."""
    return _expected


def _groups(command: str, words: Sequence[str]) -> list[str]:
    """Groups of the kernels that a command line needs."""
    if "--help" in words:
        return []
    if command == "workspace":
        return _groups_of_kinds(words)
    if command in QUESTIONS:
        return [command]
    if command not in SIMULATIONS:
        return []
    compiled = "--seeds" in words or any(word.startswith("integration.") for word in words)
    return [DEFAULT, COMPILED] if compiled else [DEFAULT]


def _will_be_refused(command: str, words: Sequence[str]) -> bool:
    """Whether a command line names no robot, or for its results what is no folder of this program.

    Only what can be seen at once; the command itself says what is wrong.
    """
    after = words[words.index(command) + 1 :]
    if command in QUESTIONS and after and not after[0].startswith("-"):
        name = after[0].partition("@")[0]
        if not os.path.isdir(ROBOTS / name) and not os.path.exists(name):  # no name is too long
            return True
    given = [word.removeprefix("--out=") for word in words if word.startswith("--out=")]
    given += [word for before, word in pairwise(words) if before == "--out"]
    return any(_is_foreign(Path(word)) for word in given)


def _is_foreign(folder: Path) -> bool:
    """Whether it is a file, or a folder that holds something and was not made by this program."""
    from cdpr_drake.analyses.reporting.written_files import MARKER

    with suppress(OSError):
        if folder.is_dir():
            return any(folder.iterdir()) and not (folder / MARKER).is_file()
        return folder.exists()
    return False


def _groups_of_kinds(words: Sequence[str]) -> list[str]:
    """Groups of a workspace: simulated breaks need other kernels than questions of statics do."""
    joined = [word.removeprefix("--kind=") for word in words if word.startswith("--kind=")]
    after = [word for before, word in pairwise(words) if before == "--kind"]
    kinds = {kind.strip() for text in (*joined, *after) for kind in text.split(",")}
    broken = BROKEN.rpartition(" ")[2]
    others = kinds - {broken} or not kinds
    return [*(["workspace"] if others else []), *([BROKEN] if broken in kinds else [])]
