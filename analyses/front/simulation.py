"""Runs of a scenario: one, or one for each of several seeds; and runs that were killed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.front.session import Say, Session
from cdpr_drake.analyses.reporting.deferred_figures import drawing, is_undrawn, write_pictures
from cdpr_drake.analyses.reporting.exported_logs import checked_log_formats, log_exports
from cdpr_drake.analyses.reporting.log_files import log_columns
from cdpr_drake.analyses.reporting.log_on_disk import CHECKPOINT, PARTS, LogOnDisk
from cdpr_drake.analyses.reporting.output_folder import (
    ResultsFolder,
    continued_folder,
    finished_folder,
    results_folder,
    resumed_folder,
    shown_path,
    unfinished_folder,
)
from cdpr_drake.analyses.simulation.monte_carlo import ManyRuns, run_many, with_seeds
from cdpr_drake.analyses.simulation.monte_carlo_report import (
    repetition_figure,
    repetition_pictures,
    repetition_summary,
    write_repetitions,
)
from cdpr_drake.analyses.simulation.monte_carlo_store import StoredRuns
from cdpr_drake.analyses.simulation.scenario_kinds import SCENARIO_KINDS, ScenarioKind
from cdpr_drake.analyses.simulation.session import RunSession, check_connected
from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.summaries import Tabulated
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import set_loop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.run_settings import RunHeader
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REPLAY = "replay.html"
"""Among the pictures of every run."""

SUMMARY, LOG = "summary.json", "log.npz"
"""The data of one run."""

SCENARIO_FILE = "scenario.yaml"
"""Of every folder of a run, see `write_run_inputs`."""


@dataclass(frozen=True, eq=False, repr=False)
class Run(Tabulated):
    """What a run did.

    Attributes:
        scenario: What was run.
        result: The result of its kind, with the log; such as `RunResult` of a visual servo.
        numbers: Its summary, as `cdpr simulate --json` prints it.
        folder: Where it was written; None: nowhere.
        failed: Of each figure that could not be written, the file and why.
        goes_on: Whether it was stopped, and `continue_run` of the folder goes on.
    """

    scenario: Any
    result: Any
    numbers: dict[str, Any]
    folder: Path | None = None
    failed: dict[str, str] = field(default_factory=dict)
    goes_on: bool = False

    @property
    def log(self) -> Any:
        """Arrays over time by name: `time` (k,) [s], `X_WP` (k, 7), `tensions` (k, m) [N], ..."""
        return self.result.log

    def as_dict(self) -> dict[str, Any]:
        """The summary for JSON; keys end in units."""
        return self.numbers

    def columns(self) -> dict[str, Any]:
        """A row a logged time, a column a number, by the names of `log.csv`."""
        return log_columns(self.log, self._kind.log_names(self.result))

    def plot(self) -> Figure:
        """Errors over time; of a pick-and-place its phases."""
        return self._kind.figure(self.result)

    def replay(self, path: Path | str = "replay.html") -> Path:
        """Writes the run in 3D as one page that opens without a network, and returns its path."""
        page = Path(path)
        self._kind.pictures(self.result, False, ())[REPLAY](page)
        return page

    def facts(self) -> list[tuple[str, str]]:
        """What its kind tells of the summary: labels and words."""
        return self._kind.facts(self.numbers)

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        told = self.numbers
        moved = told["robot"] if "robot" in told else told["mechanism"]
        rows = [("simulated", f"{told['sim_time_s']:.2f} s of {moved}")]
        if "engine" in told:
            rows.append(("engine, loop", f"{told['engine']}, {told['loop']}"))
        rows.append(("cables", told["geometry"]))
        rows += self.facts()[:6]
        rows.append(("folder", "none" if self.folder is None else str(self.folder)))
        return f"Run of {told['scenario']}: {told['outcome']}", rows

    @property
    def _kind(self) -> ScenarioKind:
        return SCENARIO_KINDS[self.scenario.kind]


@dataclass(frozen=True, eq=False, repr=False)
class RepeatedRuns(Tabulated):
    """What runs of a scenario over seeds did.

    Attributes:
        scenario: What was run.
        runs: The runs.
        numbers: Their summary, as `cdpr simulate --seeds --json` prints it.
        folder: Where it was written; None: nowhere.
        failed: Of each figure that could not be written, the file and why.
    """

    scenario: Any
    runs: ManyRuns
    numbers: dict[str, Any]
    folder: Path | None = None
    failed: dict[str, str] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """The summary for JSON; keys end in units."""
        return self.numbers

    def columns(self) -> dict[str, Any]:
        """A row a run: its seed and summary."""
        return dict(self.runs.table())

    def plot(self) -> Figure:
        """Errors of all runs over time, and where they end."""
        return repetition_figure(self.scenario, self.runs)

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        told = self.numbers
        outcomes = ", ".join(f"{count} {name}" for name, count in told["outcomes"].items())
        rows = [("outcomes", outcomes or "none"), ("took", f"{told['wall_time_s']:.1f} s")]
        for label, key, scale in (
            ("final error [mm]", "final_position_error_m", 1e3),
            ("final error [mrad]", "final_rotation_error_rad", 1e3),
        ):
            spread = told["statistics"].get(key) or {}
            words = (
                f"{name} {scale * spread[name]:.4g}"
                for name in ("median", "max")
                if spread.get(name) is not None
            )
            rows.append((label, ", ".join(words) or "-"))
        rows.append(("folder", "none" if self.folder is None else str(self.folder)))
        return f"{len(told['seeds'])} of {told['wanted']} runs of {told['scenario']}", rows


@overload
def simulate(
    scenario: RunHeader | str | Path,
    overrides: Sequence[str] = (),
    folder: Path | str | None = None,
    seeds: None = None,
    *,
    workers: int | str | None = None,
    overwrite: bool = False,
    formats: Sequence[str] = DEFAULT_FORMATS,
    log_formats: Sequence[str] = (),
    video: bool = False,
    session: Session | None = None,
) -> Run: ...


@overload
def simulate(
    scenario: RunHeader | str | Path,
    overrides: Sequence[str] = (),
    folder: Path | str | None = None,
    *,
    seeds: Sequence[int],
    workers: int | str | None = None,
    overwrite: bool = False,
    formats: Sequence[str] = DEFAULT_FORMATS,
    log_formats: Sequence[str] = (),
    video: bool = False,
    session: Session | None = None,
) -> RepeatedRuns: ...


@verb()
def simulate(
    scenario: RunHeader | str | Path,
    overrides: Sequence[str] = (),
    folder: Path | str | None = None,
    seeds: Sequence[int] | None = None,
    *,
    workers: int | str | None = None,
    overwrite: bool = False,
    formats: Sequence[str] = DEFAULT_FORMATS,
    log_formats: Sequence[str] = (),
    video: bool = False,
    session: Session | None = None,
) -> Run | RepeatedRuns:
    """Simulates a scenario of any kind until its outcome is known or its duration is over.

    Args:
        scenario: A scenario, or its name or path.
        overrides: Items "key.subkey=value" that replace what the file says; with a name or path.
        folder: Where log, summary and figures are written; None: nowhere. With seeds, what is
            finished is found there again.
        seeds: Repeats a visual servo with these; None: one run with the scenario's seed.
        workers: Processes for seeds, or the address of a Dask scheduler; None: one for each
            processor, started where more than ten seconds of work are left.
        overwrite: Whether results in the folder may be replaced.
        formats: Endings of the files of figures.
        log_formats: The log also as "mat" or "parquet"; of one run.
        video: Whether camera.mp4 is rendered too; of one run of a visual servo.
        session: Who follows the runs and may stop them; None: nobody.

    Returns:
        A `Run`, or with seeds `RepeatedRuns`.

    Raises:
        ScenarioError: Unknown or malformed scenario, or what it asks for cannot be done.
        CdprError: It cannot be built: robot, camera or initial pose.
        OutputFolderError: The folder holds other things, or cannot be written.
    """
    told, repeated = session or Session(), seeds is not None
    loaded = _loaded(scenario, overrides)
    kind = SCENARIO_KINDS[loaded.kind]
    wanted = _Wanted(tuple(formats), checked_log_formats(log_formats), video)
    _check_wanted(loaded, kind, seeds, wanted)
    loaded, note = set_loop(loaded, repeated, told.watched)
    outside = told.outside
    check_connected(loaded, None if outside is None else outside.connect)
    where = None if folder is None else Path(folder)
    if seeds is not None:
        _check(kind, loaded, "", told)
        asked = _Asked(loaded, tuple(seeds), workers, note)
        if where is None:
            return _repeat(asked, None, wanted, told)
        with continued_folder(where, overwrite) as results:
            told.opened(results)
            return _repeat(asked, results, wanted, told)
    if where is None:
        _check(kind, loaded, note, told)
        result = _run(kind, loaded, None, told)
        return Run(loaded, result, kind.numbers(result))
    if not overwrite and is_undrawn(where):
        drawn = _drawn(where, kind, loaded, wanted, told)
        if drawn is not None:
            return drawn
    with results_folder(where, overwrite) as results:
        told.opened(results)
        _check(kind, loaded, note, told)
        kind.inputs(results.path, loaded)
        return _run_into(results, kind, loaded, wanted, told)


@verb()
def continue_run(
    folder: Path | str,
    *,
    formats: Sequence[str] = DEFAULT_FORMATS,
    log_formats: Sequence[str] = (),
    video: bool = False,
    session: Session | None = None,
) -> Run:
    """Goes on with a run that was killed or stopped, from its last checkpoint, in its folder.

    Args:
        folder: Where it left its log, or was to write its results; other arguments as `simulate`.
        formats: See folder.
        log_formats: See folder.
        video: See folder.
        session: See folder.

    Raises:
        OutputFolderError: There is no such log, or the run is still going on.
        CheckpointError: There is no checkpoint of this run.
    """
    wanted = _Wanted(tuple(formats), checked_log_formats(log_formats), video)
    with resumed_folder(Path(folder)) as results:
        scenario = load_scenario(str(results.path / SCENARIO_FILE))
        kind = SCENARIO_KINDS[scenario.kind]
        return _run_into(results, kind, scenario, wanted, session or Session(), resume=True)


@verb()
def finish_run(
    folder: Path | str,
    *,
    formats: Sequence[str] = DEFAULT_FORMATS,
    log_formats: Sequence[str] = (),
    video: bool = False,
    session: Session | None = None,
) -> Run:
    """Makes log, summary and figures of what a killed run left; arguments as `continue_run`.

    Raises:
        OutputFolderError: There is no such log, or the run is still going on.
    """
    told = session or Session()
    wanted = _Wanted(tuple(formats), checked_log_formats(log_formats), video)
    with unfinished_folder(Path(folder)) as found:
        scenario = load_scenario(str(found / SCENARIO_FILE))
        kind, log = SCENARIO_KINDS[scenario.kind], LogOnDisk.open(found / PARTS)
        with told.doing("Writing results") as say:
            result = kind.unfinished(scenario, log)
            numbers = kind.data(found, result)
            log.remove()
            failed = _write_pictures(found, kind, result, wanted, say, told)
    return Run(scenario, result, numbers, found, failed)


@dataclass(frozen=True)
class _Wanted:
    """What is written of runs, beside what always is."""

    formats: tuple[str, ...]
    log_formats: tuple[str, ...]
    video: bool


@dataclass(frozen=True)
class _Asked:
    """What is repeated, who computes it, and what is told of it."""

    scenario: Scenario
    seeds: tuple[int, ...]
    workers: int | str | None
    note: str


def _check_wanted(
    scenario: Any, kind: ScenarioKind, seeds: Sequence[int] | None, wanted: _Wanted
) -> None:
    if seeds is not None and not kind.is_servo:
        raise ScenarioError(f"seeds: found with a {scenario.kind}; accepted: visual servos")
    if seeds is not None and (not seeds or len(set(seeds)) < len(seeds)):
        raise ScenarioError(f"seeds: found {list(seeds)}; accepted: different numbers, at least 1")
    if seeds is not None and (wanted.video or wanted.log_formats):
        raise ScenarioError("seeds: found with video or log_formats; accepted: without")
    if wanted.video and not kind.is_servo:
        raise ScenarioError(f"video: found with a {scenario.kind}; accepted: visual servos")


def _check(kind: ScenarioKind, scenario: Any, note: str, session: Session) -> None:
    """Checks a scenario before it is simulated, and says a note and what speaks against it."""
    with session.doing(f"{scenario.name}: building the diagram"):
        warnings = kind.check(scenario)
    if note:
        session.say(note)
    for warning in warnings:
        session.warn(warning)


def _run(
    kind: ScenarioKind, scenario: Any, log_folder: Path | None, session: Session,
    resume: bool = False,
) -> Any:  # fmt: skip
    """The result of one run."""
    prepare, outside = session.prepare(kind, scenario), session.outside
    connect = None if outside is None else outside.connect
    with session.computing():
        result = kind.run(
            scenario,
            RunSession(session.progress, session.stop, log_folder, prepare, resume, connect),
        )
        if outside is not None:
            outside.tell_end(result)
    return result


def _run_into(
    results: ResultsFolder, kind: ScenarioKind, scenario: Any, wanted: _Wanted, session: Session,
    resume: bool = False,
) -> Run:  # fmt: skip
    """One run into a folder, from the start or from a checkpoint; data first, then pictures."""
    result = _run(kind, scenario, results.path / PARTS, session, resume)
    goes_on = (
        result.outcome == Outcome.INTERRUPTED and (results.path / PARTS / CHECKPOINT).is_file()
    )
    with session.doing("Writing results") as say:
        numbers = kind.data(results.path, result)
        if not goes_on:
            result.log.remove()  # now that the log is written; it stays readable here
        folder = results.publish()
        failed = _write_pictures(shown_path(folder), kind, result, wanted, say, session)
    return Run(scenario, result, numbers, folder, failed, goes_on)


def _drawn(
    where: Path, kind: ScenarioKind, scenario: Any, wanted: _Wanted, session: Session
) -> Run | None:
    """A run that ended while its pictures were drawn, with those that were missing.

    None: the folder has data of another scenario or robot.
    """
    with TemporaryDirectory() as there:
        kind.inputs(Path(there), scenario)
        for file in Path(there).iterdir():
            same = where / file.name
            if not same.is_file() or same.read_bytes() != file.read_bytes():
                return None
    with finished_folder(where) as folder, session.doing("Drawing what is missing") as say:
        numbers = load_json((folder / SUMMARY).read_text(encoding="utf-8"))
        with np.load(folder / LOG, allow_pickle=False) as arrays:
            log = {name: arrays[name] for name in arrays.files}
        outcome = Outcome[str(numbers["outcome"]).upper()]
        result = replace(kind.unfinished(scenario, log), outcome=outcome)
        place = shown_path(folder)
        failed = _write_pictures(place, kind, result, wanted, say, session, missing=True)
    return Run(scenario, result, numbers, folder, failed)


def _write_pictures(
    folder: Path, kind: ScenarioKind, result: Any, wanted: _Wanted, say: Say, session: Session,
    *, missing: bool = False,
) -> dict[str, str]:  # fmt: skip
    """Writes pictures, those that are there anew, or only the `missing` ones."""
    pictures = log_exports(folder, wanted.log_formats)
    pictures |= kind.pictures(result, wanted.video, wanted.formats)
    if missing:
        pictures = {name: pictures[name] for name in pictures if not (folder / name).exists()}
    with drawing(folder, session.stop):
        return write_pictures(folder, pictures, lambda name: say(f"Writing {name}"), session.stop)


def _repeat(
    asked: _Asked, results: ResultsFolder | None, wanted: _Wanted, session: Session
) -> RepeatedRuns:
    """Runs of a scenario over seeds, into a folder or nowhere."""
    scenario = asked.scenario
    kept = None if results is None else StoredRuns(results.path, scenario)
    if asked.note:
        session.say(asked.note)
    with session.computing():
        runs = run_many(
            with_seeds(scenario, list(asked.seeds)), asked.workers, session.progress, session.stop,
            keep_traces=True, kept=kept, say=session.say,
        )  # fmt: skip
    if results is None:
        return RepeatedRuns(scenario, runs, repetition_summary(scenario, runs))
    with session.doing("Writing results"):
        told = write_repetitions(results.path, scenario, runs, load_robot(scenario.robot))
        folder = results.publish()
        pictures = repetition_pictures(scenario, runs, wanted.formats)
        failed = write_pictures(shown_path(folder), pictures)
    return RepeatedRuns(scenario, runs, told, folder, failed)


def _loaded(scenario: RunHeader | str | Path, overrides: Sequence[str]) -> Any:
    if isinstance(scenario, str | Path):
        return load_scenario(str(scenario), overrides)
    if not isinstance(scenario, RunHeader):
        raise ScenarioError(
            f"scenario: found a {type(scenario).__name__}; accepted: a name, a path or a scenario"
        )
    if overrides:
        raise ScenarioError("overrides: found with a scenario that is loaded; accepted: a name")
    return scenario
