"""Runs of a scenario: one, or one for each of several seeds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdpr_drake.analyses.reporting.deferred_figures import write_pictures
from cdpr_drake.analyses.reporting.log_on_disk import PARTS
from cdpr_drake.analyses.reporting.output_folder import continued_folder, results_folder
from cdpr_drake.analyses.reporting.provenance import write_run_inputs
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
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.summaries import Summarized
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import set_loop
from cdpr_drake.systems.scenarios.run_settings import ScenarioHeader

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class Run(Summarized):
    """What a run did.

    Attributes:
        scenario: What was run.
        result: The result of its kind, with the log; such as `RunResult` of a visual servo.
        numbers: Its summary, as `cdpr simulate --json` prints it.
        folder: Where it was written; None: nowhere.
        failed: Of each figure that could not be written, the file and why.
    """

    scenario: Any
    result: Any
    numbers: dict[str, Any]
    folder: Path | None
    failed: dict[str, str]

    @property
    def log(self) -> Any:
        """Arrays over time by name: `time` (k,) [s], `X_WP` (k, 7), `tensions` (k, m) [N], ..."""
        return self.result.log

    def as_dict(self) -> dict[str, Any]:
        """The summary for JSON; keys end in units."""
        return self.numbers

    def plot(self) -> Figure:
        """Errors over time; of a pick-and-place its phases."""
        return self._kind.figure(self.result)

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        told = self.numbers
        rows = [("simulated", f"{told['sim_time_s']:.2f} s of {told['robot']}")]
        if "engine" in told:
            rows.append(("engine, loop", f"{told['engine']}, {told['loop']}"))
        rows += self._kind.facts(told)[:6]
        rows.append(("folder", "none" if self.folder is None else str(self.folder)))
        return f"Run of {told['scenario']}: {told['outcome']}", rows

    @property
    def _kind(self) -> ScenarioKind:
        return SCENARIO_KINDS[self.scenario.kind]


@dataclass(frozen=True, eq=False, repr=False)
class RepeatedRuns(Summarized):
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
    folder: Path | None
    failed: dict[str, str]

    def as_dict(self) -> dict[str, Any]:
        """The summary for JSON; keys end in units."""
        return self.numbers

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


def simulate(
    scenario: ScenarioHeader | str | Path,
    overrides: Sequence[str] = (),
    folder: Path | str | None = None,
    seeds: Sequence[int] | None = None,
    *,
    workers: int | None = None,
    overwrite: bool = False,
    formats: Sequence[str] = DEFAULT_FORMATS,
    on_progress: Callable[[Any], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> Any:
    """Simulates a scenario of any kind until its outcome is known or its duration is over.

    Args:
        scenario: A scenario, or its name or path.
        overrides: Items "key.subkey=value" that replace what the file says; with a name or path.
        folder: Where log, summary and figures are written; None: nowhere. With seeds, what is
            finished is found there again.
        seeds: Repeats a visual servo with these; None: one run with the scenario's seed.
        workers: Processes for seeds; None: one for each processor.
        overwrite: Whether results in the folder may be replaced.
        formats: Endings of the files of figures.
        on_progress: Told where the run stands, a `Progress`, or with seeds a `WorkProgress`.
        should_stop: Asked often; True ends the run early, with what it has.

    Returns:
        A `Run`, or with seeds `RepeatedRuns`.

    Raises:
        ScenarioError: Unknown or malformed scenario, or what it asks for cannot be done.
        CdprError: It cannot be built: robot, camera or initial pose.
        OutputFolderError: The folder holds other things, or cannot be written.
    """
    loaded = _loaded(scenario, overrides)
    kind = SCENARIO_KINDS[loaded.kind]
    if seeds is not None and not kind.is_servo:
        raise ScenarioError(f"seeds: found with a {loaded.kind}; accepted: visual servos")
    if seeds is not None and (not seeds or len(set(seeds)) < len(seeds)):
        raise ScenarioError(f"seeds: found {list(seeds)}; accepted: different numbers, at least 1")
    loaded, _ = set_loop(loaded, seeds is not None)
    check_connected(loaded, None)
    kind.check(loaded)
    where = None if folder is None else Path(folder)
    if seeds is not None:
        scenarios = with_seeds(loaded, list(seeds))
        if where is None:
            runs = run_many(scenarios, workers, on_progress, should_stop, keep_traces=True)
            return RepeatedRuns(loaded, runs, repetition_summary(loaded, runs), None, {})
        with continued_folder(where, overwrite) as results:
            runs = run_many(
                scenarios, workers, on_progress, should_stop, keep_traces=True,
                kept=StoredRuns(results.path, loaded),
            )  # fmt: skip
            told = write_repetitions(results.path, loaded, runs, load_robot(loaded.robot))
            where = results.publish()
        failed = write_pictures(where, repetition_pictures(loaded, runs, formats))
        return RepeatedRuns(loaded, runs, told, where, failed)
    session = RunSession(on_progress, should_stop)
    if where is None:
        result = kind.run(loaded, session)
        return Run(loaded, result, kind.numbers(result), None, {})
    with results_folder(where, overwrite) as results:
        write_run_inputs(results.path, loaded, load_robot(loaded.robot))
        result = kind.run(loaded, replace(session, log_folder=results.path / PARTS))
        told = kind.data(results.path, result)
        result.log.remove()  # now that the log is written; it stays readable here
        where = results.publish()
    failed = write_pictures(where, kind.pictures(result, False, formats))
    return Run(loaded, result, told, where, failed)


def _loaded(scenario: ScenarioHeader | str | Path, overrides: Sequence[str]) -> Any:
    if isinstance(scenario, str | Path):
        return load_scenario(str(scenario), overrides)
    if not isinstance(scenario, ScenarioHeader):
        raise ScenarioError(
            f"scenario: found a {type(scenario).__name__}; accepted: a name, a path or a scenario"
        )
    if overrides:
        raise ScenarioError("overrides: found with a scenario that is loaded; accepted: a name")
    return scenario
