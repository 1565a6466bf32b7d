"""Processes of the command line: how they are started, read and ended."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO

import cdpr_drake

PROGRESS_PERIOD = "CDPR_PROGRESS_PERIOD"
"""Environment variable of the time between lines of progress [s], see `cli.terminal`."""

LIFELINE = "CDPR_LIFELINE"
"""Environment variable of the file descriptor at which a command sees the end of who started it,
see `cli.process`."""

LONGEST_LINE = 2000
"""Characters of a line that are looked at."""

LARGEST_OUTPUT = 64 * 2**20
"""Bytes of results in JSON that are read."""

COMMAND = (sys.executable, "-P", "-m", "cdpr_drake")
"""The command line; Python does not look for modules in the working folder: what lies there is
data."""

PROGRESS = "progress: "
"""How a line of progress begins, see `cli.terminal`."""

_SHARE = re.compile(r"^(?P<what>.*?): +(?P<percent>\d{1,3}) %, (?P<words>.*)$")
_ERROR = "cdpr: "


class Child:
    """One command as a process of its own group, its words in files.

    In files, so that it never waits for who reads. Of a server that was killed, which can stop
    nothing any more, it hears by the end of a pipe that only the server has, and stops by itself.
    """

    def __init__(
        self, command: Sequence[str], working: Path, *, keeps_open: Sequence[int] = ()
    ) -> None:
        """Starts it.

        Args:
            command: Program and arguments.
            working: Folder to start it in.
            keeps_open: File descriptors that it gets.

        Raises:
            OSError: It cannot be started.
        """
        self._out, self._err = _scratch_file(), _scratch_file()
        self._read, self._rest = 0, ""
        environment = dict(os.environ)
        home = str(Path(cdpr_drake.__file__).resolve().parent.parent)
        before = environment.get("PYTHONPATH", "")
        environment["PYTHONPATH"] = os.pathsep.join(part for part in (home, before) if part)
        environment[PROGRESS_PERIOD] = "1"
        theirs, ours = os.pipe()  # which no other child inherits
        self._lifeline: int | None = ours
        environment[LIFELINE] = str(theirs)
        try:
            self._process = subprocess.Popen(
                list(command),
                cwd=working, env=environment, stdin=subprocess.DEVNULL, stdout=self._out,
                stderr=self._err, pass_fds=(*keeps_open, theirs), start_new_session=True,
            )  # fmt: skip
        except OSError:
            self.close()
            raise
        finally:
            os.close(theirs)

    @property
    def process_id(self) -> int:
        """Of the process."""
        return self._process.pid

    def ended(self) -> int | None:
        """Exit code, negative for a signal; None as long as it works."""
        return self._process.poll()

    def ask_to_stop(self) -> None:
        """Sends SIGTERM, which commands take as a wish; what is finished is kept."""
        self._signal(signal.SIGTERM, whole_group=False)

    def kill(self) -> None:
        """Ends it and all that it started."""
        self._signal(signal.SIGKILL, whole_group=True)

    def _signal(self, number: int, *, whole_group: bool) -> None:
        if self._process.poll() is not None:
            return
        with suppress(ProcessLookupError, PermissionError):
            (os.killpg if whole_group else os.kill)(self._process.pid, number)

    def lines(self) -> list[str]:
        """Lines of its messages since the last look; an unfinished one comes when it is whole."""
        size = os.fstat(self._err.fileno()).st_size
        if size == self._read:
            return []
        piece = os.pread(self._err.fileno(), size - self._read, self._read)
        self._read += len(piece)
        *whole, self._rest = (self._rest + piece.decode(errors="replace")).split("\n")
        return [line[:LONGEST_LINE].rstrip() for line in whole if line.strip()]

    def last_words(self) -> str:
        """What was not a whole line when it ended."""
        return self._rest[:LONGEST_LINE].strip()

    def output(self) -> bytes:
        """What it printed; empty where that is larger than anybody would read."""
        size = os.fstat(self._out.fileno()).st_size
        return b"" if size > LARGEST_OUTPUT else os.pread(self._out.fileno(), size, 0)

    def close(self) -> None:
        """Throws its files away."""
        self._out.close()
        self._err.close()
        if self._lifeline is not None:
            os.close(self._lifeline)
            self._lifeline = None


def _scratch_file() -> IO[bytes]:
    """A file without a name, which is gone when it is closed."""
    return tempfile.TemporaryFile()


def progress_of(line: str) -> tuple[float | None, str] | None:
    """Share from 0 to 1, None where it says none, and words of a line of progress; None: no such
    line."""
    if not line.startswith(PROGRESS):
        return None
    words = line.removeprefix(PROGRESS)
    found = _SHARE.match(words)
    if found is None:
        return None, words
    return min(int(found["percent"]) / 100.0, 1.0), f"{found['what']}: {found['words']}"


def reason(lines: Sequence[str], code: int) -> str:
    """Why a command failed, in one line, from its messages and its exit code."""
    said = [line.removeprefix(_ERROR) for line in lines if line.startswith(_ERROR)]
    if said:
        more = len(said) - 1
        return said[0] + (f"; and {more} more" if more else "")
    if code < 0:
        name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
        return f"the process was ended by {name}"
    last = lines[-1] if lines else "it said nothing"
    return f"exit code {code}: {last}"
