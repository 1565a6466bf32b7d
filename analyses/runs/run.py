"""A run of a scenario: what all kinds share, from the start to the files.

A kind is one class: how it is built and steps (`engine`), its numbers, its sections, its figures.
"""

from __future__ import annotations

import hashlib
import shlex
import shutil
import time
import zipfile
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from cdpr_drake.analyses.frame.figures import figure_writers
from cdpr_drake.analyses.frame.folder import Folder, shown_path
from cdpr_drake.analyses.frame.follow import NOBODY, Follow, Progress
from cdpr_drake.analyses.frame.result import STOPPED, Result, Table
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.reporting.provenance import (
    code_version,
    package_versions,
    write_run_inputs,
)
from cdpr_drake.analyses.runs.engine import Engine
from cdpr_drake.analyses.runs.log import (
    CHECKPOINT,
    PARTS,
    DiskLog,
    Log,
    Recorder,
    StoredLog,
    column_names,
    log_block,
    write_log,
)
from cdpr_drake.arrays import Array
from cdpr_drake.errors import (
    CableGeometryError,
    ClientEndedError,
    DivergedError,
    OutputFolderError,
    ScenarioError,
)
from cdpr_drake.models.mechanism_files import mechanism_names
from cdpr_drake.models.robot_loader import load_robot, robot_names
from cdpr_drake.schema.input_files import input_bytes
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.schema.typed_yaml import plain_values
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.files import scenario_names
from cdpr_drake.systems.sections import load_object, sections_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdpr_drake.analyses.visualization.live_view import Prepare

PIECE = 0.1
"""Simulated time between reports of progress and looks at a request to stop [s]."""


@dataclass(frozen=True, eq=False)
class Subject:
    """A subject of a run: its numbers in the summary, its figures, or both.

    A kind of run has its subjects in `Run.subjects`, a section of a scenario in its `report`.

    Attributes:
        key: Key of the numbers in `summary.json`; empty: none of its own.
        numbers: Returns the numbers of a run.
        figures: Functions that draw a run, by names of files without ending; or what returns
            functions without arguments, by such names, of a run.
        applies: True for a run that has the subject.
    """

    key: str
    numbers: Callable[[Any], Any] | None = None
    figures: Mapping[str, Callable[[Any], Figure]] | Callable[[Any], Mapping[str, Any]] | None = (
        None
    )
    applies: Callable[[Any], Any] = lambda run: True

    def drawn(self, run: Any) -> dict[str, Callable[[], Figure]]:
        """What draws a run, by the names of files without ending."""
        if callable(self.figures):
            return dict(self.figures(run))
        return {name: partial(draw, run) for name, draw in (self.figures or {}).items()}


class Run(Result):
    """A run of a scenario, before, during and after its simulation.

    Attributes:
        kind: Of its scenario, as a file gives it.
        subjects: Subjects that a run may have, in the order of `summary.json`, before those of
            the sections of its scenario.
        scenario: The scenario.
        built: The diagram and its handles, made at the first use.
        robot: The robot, or the mechanism.
        log: Arrays over time by name: `time` (k,) [s], `X_WP` (k, 7), `tensions` (k, m) [N], ...;
            empty before `simulate`.
        outcome: How it ended.
        message: Why, if there is more to say.
        sim_time: Simulated time [s].
        wall_time: Time of the simulation, without building and writing [s].
        folder: Where it was written; None: nowhere.
        failed: Files that could not be written, and why.
        at_end: What only the diagram knew at its end, for reports of sections, by names.
        stopped: True if somebody stopped it before all its files were written.
        chosen_end: True if the user chose the duration, which then explains a timeout.
    """

    kind: ClassVar[str]
    subjects: ClassVar[Sequence[Subject]] = ()
    built: Any
    log: Log

    def __init__(self, scenario: Any) -> None:
        """Of a scenario.

        Raises:
            ScenarioError: It is of another kind.
        """
        if scenario.kind != self.kind:
            raise ScenarioError(
                f"{scenario.name}: kind: found {scenario.kind}; accepted: {self.kind}; "
                "cdpr_drake.simulate runs all kinds"
            )
        self.scenario = scenario
        self.log = {}
        self.outcome, self.message, self.sim_time, self.wall_time = Outcome.RUNNING, "", 0.0, 0.0
        self.folder: Path | None = None
        self.failed: dict[str, str] = {}
        self.at_end: dict[str, Any] = {}
        self.stopped = self.chosen_end = False

    @abstractmethod
    def check(self) -> list[str]:
        """Builds it; returns warnings; raises CdprError if it cannot be built."""

    @abstractmethod
    def engine(self, follow: Follow, resume: bool) -> Engine:
        """What steps it from its start."""

    def note(self, engine: Engine) -> None:
        """Notes at the end what only the engine knows."""

    @abstractmethod
    def numbers(self) -> dict[str, Any]:
        """Numbers of its kind for the summary, without those of its sections."""

    @abstractmethod
    def main_figures(self) -> dict[str, Callable[[], Figure]]:
        """Figures of its kind by name; the first is the most telling."""

    @abstractmethod
    def replay(self, path: Path) -> None:
        """Writes the run in 3D as one page, which opens without a network."""

    @abstractmethod
    def facts(self, summary: Mapping[str, Any]) -> list[tuple[str, str]]:
        """Labels and words of its summary, for a terminal."""

    @abstractmethod
    def end_error(self) -> tuple[float, float]:
        """True distance [m] and angle [rad] from the goal at the end."""

    @abstractmethod
    def subtitle(self) -> str:
        """What the run was, in a few words, below the titles of figures."""

    def live(self, meshcat: Any) -> Prepare | None:
        """What lets Meshcat follow it; None: nothing does."""
        return None

    def log_names(self) -> dict[str, Sequence[str] | str]:
        """Names of cables and features, and of the numbers of further quantities of the log, or
        the unit of those that have a number for each cable."""
        names: dict[str, Sequence[str] | str] = {}
        for _, section in sections_of(self.scenario):
            names |= section.log_columns()
        return names | {"cables": [cable.name for cable in self.robot.cables]}

    def arguments(self) -> dict[str, Any]:
        """All that the run depends on, for JSON: code, scenario, and files by their contents."""
        settings = plain_values(self.scenario)
        del settings["robot"]
        file = getattr(getattr(self.scenario, "trajectory", None), "file", None)
        if file is not None:
            settings["trajectory"]["file"] = hashlib.sha256(input_bytes(Path(file))).hexdigest()
        robot = plain_values(load_robot(self.scenario.robot))
        return {"cdpr_drake": code_version(), "scenario": settings, "robot": robot}

    def write_inputs(self, folder: Path) -> None:
        """Writes robot and scenario as they are run, so that the folder can be run again."""
        write_run_inputs(folder, self.scenario, self.robot)

    @cached_property
    def robot(self) -> Any:
        """The robot, or the mechanism."""
        return self.built.robot

    @np.errstate(over="ignore", invalid="ignore")  # a run that diverges says so in its outcome
    def simulate(self, folder: Path | None = None, follow: Follow = NOBODY) -> Self:
        """Simulates until an outcome is known or the duration is over.

        Args:
            folder: Where log and checkpoints grow, or where an earlier process left a checkpoint,
                from which the run goes on; None: the log stays in memory.
            follow: Who follows.

        Raises:
            CdprError: It cannot be built.
            CheckpointError: The checkpoint is damaged.
            OSError: The log cannot be written.
        """
        self._check_connected(follow)
        parts = None if folder is None else folder / PARTS
        resume = parts is not None and (parts / CHECKPOINT).is_file()
        engine = self.engine(follow, resume)
        repeatable = engine.outside is None and not follow.acts
        if not repeatable and parts is not None and parts.is_dir():
            raise OutputFolderError(
                f"{folder}: found the log of a run with a process outside, which cannot go on; "
                "accepted: cdpr finish, or another folder"
            )
        recorder = Recorder(engine, parts, checkpoints=repeatable)
        began = time.perf_counter() - (recorder.earlier or 0.0)
        if engine.outside is not None and follow.connect is not None:
            follow.connect(engine.outside)
        engine.start(recorder.earlier is not None, follow, self)
        self.outcome = Outcome.RUNNING
        try:
            while self.outcome == Outcome.RUNNING:
                self.outcome = engine.step(engine.now() + PIECE)
                if self.outcome == Outcome.RUNNING:  # nobody goes on from an end
                    recorder()
                follow.progress(self._progress(engine, time.perf_counter() - began))
                if self.outcome == Outcome.RUNNING and follow.stop():
                    self.outcome = Outcome.INTERRUPTED
                    recorder.save()
        except KeyboardInterrupt:
            self.outcome = Outcome.INTERRUPTED
        except ClientEndedError as problem:
            self.outcome, self.message = Outcome.CLIENT_ENDED, str(problem)
        except (CableGeometryError, DivergedError) as problem:  # no cable can run
            self.outcome, self.message = Outcome.DIVERGED, str(problem)
        except RuntimeError as problem:  # of Drake, which refuses NaN
            if "NaN" not in str(problem) and not engine.is_lost():
                raise
            self.outcome, self.message = Outcome.DIVERGED, str(problem).splitlines()[0]
        self.stopped = self.outcome == Outcome.INTERRUPTED
        self.wall_time = time.perf_counter() - began
        self.sim_time, self.log = engine.now(), recorder.finish()
        self.note(engine)
        follow.ended(self)
        return self

    def _check_connected(self, follow: Follow) -> None:
        """Refuses a run whose loop nobody closes, or without a place for who should."""
        keys = [key for key, section in sections_of(self.scenario) if section.outside]
        name = self.scenario.name
        if keys and follow.connect is None:
            raise ScenarioError(
                f"{name}: {keys[0]}: found a section, so a process outside closes the loop; "
                f"accepted: cdpr serve, or {keys[0]}: null"
            )
        if not keys and follow.connect is not None:
            raise ScenarioError(
                f"{name}: found no section that lets a process outside close the loop; accepted: "
                "one of these"
            )

    def _progress(self, engine: Engine, seconds: float) -> Progress:
        """How far it is, and how far from its goal."""
        distance, angle = engine.errors()
        words = f"error {1e3 * distance:.1f} mm {np.degrees(angle):.1f} deg"
        return Progress(words, engine.now(), self.scenario.duration, unit="s", seconds=seconds)

    def recover(self, folder: Path) -> Self:
        """Takes the log of a process that ended before the run did.

        Raises:
            OutputFolderError: The folder has no whole row of a log.
        """
        self.log = log = DiskLog(folder / PARTS)
        if log.rows == 0:
            raise OutputFolderError(f"{folder}: found a log without a whole row")
        self.outcome, self.sim_time = Outcome.INTERRUPTED, float(log["time"][-1])
        self.message = "the program ended before the run did"
        return self

    def read(self, folder: Path) -> bool:
        """Takes log and summary of a run whose files are all written; False if it is none.

        What only an engine knows stays None, and `at_end` empty.
        """
        files = [folder / name for name in ("log.npz", "log.csv", "summary.json")]
        if (folder / PARTS).exists() or not all(path.is_file() for path in files):
            return False
        try:
            self.log = StoredLog(files[0])
            self._summary = load_json(files[2].read_text(encoding="utf-8"))
        except (OSError, ValueError, zipfile.BadZipFile):
            return False
        self.outcome = Outcome[self._summary["outcome"].upper()]
        self.message, self.folder = self._summary["message"], folder
        self.sim_time, self.wall_time = self._summary["sim_time_s"], self._summary["wall_time_s"]
        return True

    def write(self, folder: Folder) -> None:
        """Writes log and summary.

        Raises:
            OutputFolderError: They cannot be written.
        """
        write_log(folder, self.log, self.log_names())
        folder.write_json("summary.json", self.as_dict())
        self.folder = folder.path

    def draw(
        self, folder: Folder, formats: Sequence[str] = DEFAULT_FORMATS,
        exports: Mapping[str, Callable[[Path], object]] | None = None, follow: Follow = NOBODY,
        only_missing: bool = False,
    ) -> None:  # fmt: skip
        """Writes figures, exports and replay, one of which spoils no other, see `failed`.

        Args:
            folder: The open folder, with log and summary.
            formats: Formats of figures.
            exports: Further writers, by names of files.
            follow: Who follows; figures that are not begun when it stops are left out.
            only_missing: True to leave files as they are.
        """
        writers = {**(exports or {}), **figure_writers(self.figures(), formats)}
        writers["replay.html"] = self.replay
        duration = self.scenario.duration

        def write(name: str, path: Path) -> None:
            follow.progress(Progress(f"writing {name}", self.sim_time, duration, unit="s"))
            writers[name](path)

        names = [n for n in writers if not (only_missing and (folder.path / n).exists())]
        failed = folder.write_all({name: partial(write, name) for name in names}, follow.stop)
        self.failed = {} if follow.stop() else failed

    def settle(self, folder: Folder, **more: Any) -> None:
        """Removes the log that grew: from now on `log` reads `log.npz`; `more` as of `complete`."""
        self.log = StoredLog(folder.path / "log.npz")
        shutil.rmtree(folder.path / PARTS, ignore_errors=True)
        folder.complete(**more)

    def as_dict(self) -> dict[str, Any]:
        """The summary, as `summary.json` has it; numbers that are not finite are None."""
        return self._summary

    @cached_property
    def _summary(self) -> dict[str, Any]:
        summary = self.numbers()
        for subject in self._applying():
            if subject.key and subject.numbers is not None:
                summary[subject.key] = subject.numbers(self)
        cleaned: dict[str, Any] = finite(summary)
        return cleaned

    def _applying(self) -> list[Subject]:
        """Subjects of this run: those of its kind, then those of its scenario's sections."""
        of_sections = (
            load_object(section.report)
            for _, section in sections_of(self.scenario) if section.report
        )  # fmt: skip
        subjects = dict.fromkeys([*self.subjects, *chain.from_iterable(of_sections)])
        return [subject for subject in subjects if subject.applies(self)]

    def ending(self) -> dict[str, Any]:
        """How it ended, as summaries have it."""
        return {
            "outcome": self.outcome.name.lower(), "message": self.message,
            "sim_time_s": self.sim_time, "wall_time_s": self.wall_time,
            "realtime_factor": self.sim_time / self.wall_time if self.wall_time > 0.0 else None,
        }  # fmt: skip

    def versions(self) -> dict[str, str]:
        """Versions that its numbers depend on."""
        return package_versions()

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """What draws it, by the names of files without ending; the first is the most telling."""
        drawn = self.main_figures()
        for subject in self._applying():
            drawn |= subject.drawn(self)
        return drawn

    @cached_property
    def heading(self) -> str:
        """Title of the scenario; empty if that is of the package and the robot is a user's."""
        shipped = self.robot.name in (*robot_names(), *mechanism_names())
        return self.scenario.title if shipped or self.scenario.name not in scenario_names() else ""

    def title(self, words: str) -> str:
        """Title of a figure: what it shows, and below what the run was."""
        name = self.scenario.name if self.heading else f"{self.robot.name}, {self.scenario.name}"
        lines = words, self.heading, f"({name}, {self.subtitle()})"
        return "\n".join(line for line in lines if line)

    def columns(self) -> dict[str, Array]:
        """A row a logged time, a column a number, by the names of `log.csv`."""
        rows = len(self.log["time"])
        table = np.column_stack([log_block(self.log, name, 0, rows) for name in self.log])
        return dict(zip(column_names(self.log, self.log_names()), table.T, strict=True))

    def to_dataframe(self) -> Any:
        """The columns as a pandas DataFrame."""
        import pandas as pd  # some half a second, which few need

        return pd.DataFrame(self.columns())

    def tables(self) -> list[Table]:
        """What it came to."""
        summary = self.as_dict()
        as_asked = self.chosen_end and self.outcome == Outcome.TIMEOUT
        end = f"ended at {self.sim_time:g} s, as asked" if as_asked else summary["outcome"]
        factor = summary["realtime_factor"] or 0.0
        rows = [
            ("simulated", f"{self.sim_time:.2f} s, {factor:.1f} x real time"),
            ("cables", summary["geometry"]), *self.facts(summary),
            *(("remark", remark) for remark in summary.get("remarks", ())),
            ("results", "none" if self.folder is None else str(shown_path(self.folder))),
        ]  # fmt: skip
        if summary["message"] and not as_asked:
            rows.append(("message", summary["message"]))
        return [Table(f"{self.scenario.name}: {end}", rows=rows)]

    def notes(self) -> list[str]:
        """What stopped it, and how to go on."""
        time, lines = f"{self.sim_time:g} s of simulated time", []
        if self.stopped:
            again = "the same command goes on"
            if self.outcome == Outcome.INTERRUPTED and not self._has_checkpoint():
                again = "what was simulated is kept"
                if self.folder is not None:
                    again = f"cdpr finish {shlex.quote(str(shown_path(self.folder)))} draws it"
            lines.append(f"Interrupted at {time}; {again}")
        elif self.outcome == Outcome.CLIENT_ENDED:
            lines.append(f"cdpr: the run ended at {time}: {self.message}")
        if self.failed and self.folder is not None:
            lines.append(
                f"The data is complete in {shown_path(self.folder)}; "
                "the same command draws what is missing"
            )
        return lines

    def _has_checkpoint(self) -> bool:
        """True if the same command goes on from the end of the log, and does not begin anew."""
        return isinstance(self.log, DiskLog) and (self.log.folder / CHECKPOINT).is_file()

    @property
    def exit_code(self) -> int:
        """Of a command that ends with it."""
        if self.stopped:
            return STOPPED
        return ClientEndedError.exit_code if self.outcome == Outcome.CLIENT_ENDED else 0
