"""Logs of real machines, read as recorders write them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdpr_drake.analyses.logs.clock_pairs import JoinedLogs, join_logs
from cdpr_drake.analyses.logs.log_formats import AUTO, read_recorded
from cdpr_drake.analyses.logs.log_request import LogRequest
from cdpr_drake.analyses.logs.recorded_log import RecordedLog
from cdpr_drake.summaries import Summarized

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class ImportedLog(Summarized):
    """A log with SI units in its headers.

    Attributes:
        log: The log.
        joined: How the clock of a second file was read; None without one.
    """

    log: RecordedLog
    joined: JoinedLogs | None = None

    def write(self, path: Path | str) -> None:
        """Writes it as `calibrate` and `identify` take it."""
        self.log.write(Path(path))

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        clocks = None if self.joined is None else self.joined.as_dict()
        return {**self.log.as_dict(), "clocks": clocks}

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        title, rows = self.log.summary()
        return title, rows if self.joined is None else [("clocks", self.joined.words()), *rows]

    def plot(self) -> Figure:
        """What is in it over time, or over rows where there is none."""
        from cdpr_drake.analyses.logs.log_figures import log_figure

        return log_figure(self.log)


def import_log(
    path: Path | str,
    request: LogRequest | None = None,
    *,
    format: str = AUTO,
    beside: Path | str | None = None,
    beside_format: str = AUTO,
    start: float | None = None,
    end: float | None = None,
    every: int = 1,
) -> ImportedLog:
    """Reads a log of a machine, and one that another recorder wrote of the same motion.

    Args:
        path: OptiTrack Motive's CSV, GRAB's raw log or parsed .mat, GTGraffiti's controller log, a
            Hangprinter's series, or text with columns.
        request: Names of cables, units, rates and what else the files do not say; a mapping is of
            the first file only.
        format: A name of `LOG_READERS`; `auto`: told by the file.
        beside: The second recorder's file, whose clock is read as the first one's.
        beside_format: Its format.
        start: First instant that is kept [s].
        end: Last instant that is kept [s].
        every: Of how many rows one is kept.

    Returns:
        The log; `write` gives the file that `calibrate` and `identify` take.

    Raises:
        LogFileError: A file is not accepted; one line.
        ClockError: Both are not of one motion, or it repeats itself.
    """
    asked = LogRequest() if request is None else request
    log = read_recorded(Path(path), format, asked)
    joined = None
    if beside is not None:
        other = LogRequest(
            cables=asked.cables, units=asked.units, body=asked.body, rate=asked.rate,
            R_WF=asked.R_WF,
        )  # fmt: skip
        joined = join_logs(log, read_recorded(Path(beside), beside_format, other))
        log = joined.log
    if start is not None or end is not None or every != 1:
        log = log.part(start, end, every)
    return ImportedLog(log, joined)
