"""Logs of real machines, read as recorders write them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.logs.log_formats import AUTO, read_recorded, unused
from cdpr_drake.analyses.logs.log_replay import SUMMARY, LogReplay
from cdpr_drake.analyses.logs.log_replay import replay_log as compare_log
from cdpr_drake.analyses.logs.log_request import LogRequest
from cdpr_drake.analyses.logs.packets import without_packets
from cdpr_drake.analyses.logs.recorded_log import RecordedLog
from cdpr_drake.analyses.reporting.deferred_figures import drawing, write_pictures
from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reporting.output_folder import results_folder
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.summaries import Summarized

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdpr_drake.analyses.logs.clock_pairs import JoinedLogs
    from cdpr_drake.analyses.logs.followed_log import FollowedLog


@dataclass(frozen=True, eq=False, repr=False)
class ImportedLog(Result):
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

    def tables(self) -> list[Table]:
        """None."""
        return []

    def lines(self) -> list[str]:
        """What it is and holds, a line each."""
        log = self.log
        lines = [f"{log.path}: {log.format}, as {log.why}", f"  rows: {log.row_report().words()}"]
        if self.joined is not None:
            lines.append(f"  clocks: {self.joined.words()}")
        headers: dict[int, list[str]] = {}
        for header, rows in log.measured().items():
            headers.setdefault(rows, []).append(header)
        lines += [f"  in {rows} rows: {', '.join(names)}" for rows, names in headers.items()]
        lines += [f"  {what}: {words}" for what, words in log.units.items()]
        return lines + [f"  note: {words}" for words in log.remarks]

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """What is in it over time, or over rows if it has no times."""
        return {"log": self._draw}

    def _draw(self) -> Figure:
        from cdpr_drake.analyses.logs.log_figures import log_figure

        return log_figure(self.log)


@verb()
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
        every: Keeps every n-th row.

    Returns:
        The log; `write` gives the file that `calibrate` and `identify` take.

    Raises:
        LogFileError: A file is not accepted; one line.
        ClockError: Both are not of one motion, or it repeats itself.
    """
    asked = LogRequest() if request is None else request
    log = without_packets(read_recorded(Path(path), format, asked))
    joined = None
    idle = unused(log, asked)
    if beside is not None:
        from cdpr_drake.analyses.logs.clock_pairs import join_logs  # which loads SciPy's signals

        other = LogRequest(
            cables=asked.cables, units=asked.units, body=asked.body, rate=asked.rate,
            R_WF=asked.R_WF,
        )  # fmt: skip
        second = read_recorded(Path(beside), beside_format, other)
        idle = tuple(words for words in idle if words in unused(second, other))
        joined = join_logs(log, without_packets(second))
        log = joined.log
    if idle:
        log = replace(log, remarks=(*log.remarks, *(f"not used: {words}" for words in idle)))
    if start is not None or end is not None or every != 1:
        log = log.part(start, end, every)
    return ImportedLog(log, joined)


@dataclass(frozen=True, eq=False, repr=False)
class ReplayedLog(Summarized):
    """A log beside a model of its robot.

    Attributes:
        replay: Lengths, poses and tensions of both.
        followed: What the simulated robot did with the log's lengths; None: it was not asked.
    """

    replay: LogReplay
    followed: FollowedLog | None = None

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        told = None if self.followed is None else self.followed.as_dict()
        return {**self.replay.as_dict(), "followed": told}

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        title, rows = self.replay.summary()
        if self.followed is not None:
            error = self.followed.as_dict()["position_error_rms_m"]
            words = "no measured pose" if error is None else f"{1e3 * error:.4g} mm rms"
            rows.insert(1, ("simulated", f"follows the log's lengths: {words} from what was"))
        return title, rows

    def plot(self) -> Figure:
        """Residuals by cable, and distances of positions."""
        from cdpr_drake.analyses.logs.replay_figures import residual_figure

        return residual_figure(self.replay, self.followed)


@verb()
def replay_log(
    path: Path | str,
    robot: Robot | str | Path,
    request: LogRequest | None = None,
    *,
    format: str = AUTO,
    fit_frame: bool = False,
    follow: bool = False,
    folder: Path | str | None = None,
    overwrite: bool = False,
    formats: tuple[str, ...] = ("png",),
) -> ReplayedLog:
    """Puts a log of a machine beside a model of it.

    Args:
        path: The log, see `import_log`.
        robot: The robot, or its name or path.
        request: What the file does not say; its cables are the robot's.
        format: A name of `LOG_READERS`; `auto`: told by the file.
        fit_frame: Whether the tracker's frame is fitted to the positions by lengths.
        follow: Whether the simulated robot is driven with the log's lengths.
        folder: Where summary, table, figures and the replay page are written; None: nowhere.
        overwrite: Whether results in the folder are replaced.
        formats: Of the figures.

    Raises:
        CdprError: The log or the robot is not accepted; one line.
    """
    loaded = as_robot(robot, "replay_log")
    asked = LogRequest() if request is None else request
    if asked.cables is None:
        asked = replace(asked, cables=tuple(cable.name for cable in loaded.cables))
    found = compare_log(loaded, read_recorded(Path(path), format, asked), fit_frame)
    followed = None
    if follow:
        from cdpr_drake.analyses.logs.followed_log import follow_log

        followed = follow_log(found)
    result = ReplayedLog(found, followed)
    if folder is not None:
        from cdpr_drake.analyses.logs.replay_figures import replay_pictures

        with results_folder(Path(folder), overwrite, redo=True) as results:
            found.write(results.path)
            write_json(results.path / SUMMARY, result.as_dict())
            with drawing(results.publish()):
                write_pictures(results.path, replay_pictures(found, result.followed, formats))
    return result
