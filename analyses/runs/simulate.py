"""Verbs of runs: simulate a scenario, or write up a run that was interrupted."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from cdpr_drake.analyses.frame.folder import (
    Folder,
    free_folder,
    read_marker,
    results_folder,
    shown_path,
)
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Formats,
    Host,
    OutFolder,
    Overrides,
    Port,
    ScenarioWord,
    Switch,
    names,
    one_of,
    words,
)
from cdpr_drake.analyses.reporting.exported_logs import checked_log_formats, log_exports
from cdpr_drake.analyses.runs.log import PARTS
from cdpr_drake.analyses.runs.mechanism import MechanismRun
from cdpr_drake.analyses.runs.pick_and_place import PickAndPlaceRun
from cdpr_drake.analyses.runs.run import Run
from cdpr_drake.analyses.runs.scenarios import scenario_with
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.servo_figures import FILM, write_film
from cdpr_drake.analyses.runs.steering import steered
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.analyses.visualization.meshcat_window import LOCAL, open_meshcat, page_address
from cdpr_drake.errors import OutputFolderError, ScenarioError
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import set_loop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO

_LOG = logging.getLogger(__name__)

KINDS: dict[str, type[Run]] = {
    run.kind: run for run in (ServoRun, TensionRun, PickAndPlaceRun, MechanismRun)
}
"""By the name that a scenario file gives as `kind`."""

Camera = Annotated[str | None, one_of(("rendered", "projected"))]
LogFormats = Annotated[
    Sequence[str],
    words(lambda word: checked_log_formats(names(word)), "mat, parquet, mcap, or several with "
          "commas", "FORMAT,...", name="--log-format"),
]  # fmt: skip


@verb()
def simulate(
    scenario: ScenarioWord = DEFAULT_SCENARIO, overrides: Overrides = (), *,
    folder: OutFolder = None, camera: Camera = None, duration: float | None = None,
    seed: int | None = None, log_rate: float | None = None, overwrite: Switch = False,
    formats: Formats = DEFAULT_FORMATS, log_formats: LogFormats = (), video: Switch = False,
    meshcat: Switch = False, host: Host = None, port: Port = None,
    steered_by: Annotated[int | None, Parameter(show=False)] = None,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Run:  # fmt: skip
    """Simulates a scenario and writes summary, log, figures and replay.

    The same command goes on with a run that was killed or interrupted, in its folder, gives the
    same numbers as an uninterrupted run, and draws what is missing. A complete run in a folder that
    is named is read again, and not simulated.

    Args:
        scenario: Scenario by name, path of a YAML file, or folder of a run, to repeat it.
        overrides: Key and value of the scenario, such as controller.lambda_0=1.5.
        folder: Results folder; default: runs/SCENARIO, or SCENARIO-2, ...; in Python nothing is
            kept.
        camera: Images of a renderer, or the target's corners by projection.
        duration: Longest simulated time [s].
        seed: Seed of noise and random directions.
        log_rate: Rows of the log per second [Hz]; long runs need few.
        overwrite: Replace earlier results in the folder.
        formats: Formats of the figures in the folder.
        log_formats: The log also as mat (MATLAB), parquet or mcap; log.csv and log.npz are always
            there.
        video: Render camera.mp4 too.
        meshcat: Show the run in a browser, at real time at most.
        host: With meshcat: name or address of this machine at which Meshcat listens, * for all;
            default: only this machine can connect.
        port: With meshcat: its port; default: a free one from 7000 to 7099.
        steered_by: Open socket of the program that follows and steers it.
        follow: Who follows.

    Raises:
        ScenarioError: Unknown or malformed scenario, or its kind has no camera, film or picture.
        CdprError: It cannot be built: robot, camera or initial pose.
        CheckpointError: The checkpoint in the folder is damaged.
        OutputFolderError: The folder holds other results or files, or cannot be written.
    """
    loaded = scenario_with(
        scenario, overrides, camera=camera, duration=duration, seed=seed, log_rate=log_rate
    )
    loaded, note = set_loop(loaded, False, meshcat or steered_by is not None)
    run = KINDS[loaded.kind](loaded)
    run.chosen_end = duration is not None
    _check_options(run, video, meshcat, host or port, steered_by)
    exports = checked_log_formats(log_formats)
    if meshcat:
        follow = replace(follow, prepare=_in_meshcat(run, host or LOCAL, port, follow))
    elif steered_by is not None:
        follow = steered(follow, loaded, steered_by)
    follow.doing(f"{loaded.name}: building the diagram")
    warnings = run.check()
    base, arguments = f"runs/{loaded.name}", run.arguments() | {"steered": follow.acts}
    if follow.connect is not None and folder is None and follow.results is not None:
        folder = free_folder(follow.results.parent / base, {})  # no such run goes on
    seen = follow.prepare is not None or follow.connect is not None
    again = folder is not None and not seen
    with results_folder(base, arguments, folder, overwrite, follow.results, again) as results:
        say_remarks(note, warnings, follow)
        if results is None:
            return run.simulate(None, follow)
        complete = run.read(results.path)
        if complete:
            follow.say(f"reused the run of {shown_path(results.path)}")
        else:
            _simulate_into(results, run, follow)
        if run.outcome != Outcome.INTERRUPTED:
            run.draw(results, formats, _exports(run, results, exports, video), follow, complete)
            run.stopped = follow.stop()
        if not run.stopped and not run.failed:
            run.settle(results)
    return run


def _simulate_into(results: Folder, run: Run, follow: Follow) -> None:
    """Simulates a run, from a checkpoint if there is one, and writes inputs, log and summary."""
    _write_inputs(run, results)
    with results.writing():
        parts = results.claim(PARTS)
        try:
            run.simulate(results.path, follow)
        except BaseException:
            if not parts.exists():  # nothing was simulated
                results.discard()
            raise
    if follow.acts:  # what was done by hand stands in the scenario now
        _write_inputs(run, results)
    run.write(results)


@verb()
def finish_run(
    folder: Annotated[Path, words(Path, "the path of a folder", "FOLDER")], *,
    formats: Formats = DEFAULT_FORMATS, log_formats: LogFormats = (), video: Switch = False,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Run:  # fmt: skip
    """Writes log, summary and figures of a run that was interrupted, without going on.

    Args:
        folder: Its results folder.
        formats: Formats of the figures in the folder.
        log_formats: The log also as mat (MATLAB), parquet or mcap.
        video: Render camera.mp4 too.
        follow: Who follows.

    Raises:
        OutputFolderError: There is no log of an interrupted run, or the run is still going on.
    """
    path, exports = Path(folder), checked_log_formats(log_formats)
    marker = read_marker(path)
    if marker is None or marker["complete"] or not (path / PARTS).is_dir():
        raise OutputFolderError(f"{folder}: found no log of an interrupted run; accepted: one")
    scenario = load_scenario(path / "scenario.yaml")
    run = KINDS[scenario.kind](scenario)
    _check_options(run, video)
    with Folder(path, marker["arguments"]) as results:
        run.recover(results.path).write(results)
        run.draw(results, formats, _exports(run, results, exports, video), follow)
        run.stopped = follow.stop()
        if not run.stopped:
            run.settle(results, interrupted_at_s=run.sim_time)
    return run


def say_remarks(note: str, warnings: Sequence[str], follow: Follow) -> None:
    """Says a note and warnings of a run; Python prints the warnings on stderr if nobody follows."""
    if follow is NOBODY:
        for warning in warnings:
            _LOG.warning("%s", warning)
    for line in [*filter(None, [note]), *(f"warning: {warning}" for warning in warnings)]:
        follow.say(line)


def _check_options(
    run: Run, video: bool, meshcat: bool = False, listens: object = None,
    steered_by: int | None = None,
) -> None:  # fmt: skip
    """Refuses options that the kind of a run does not have, or that do not go together."""
    kind = run.scenario.kind
    if video and not isinstance(run, ServoRun):
        raise ScenarioError(f"video: found with a {kind}; accepted: with a visual servo")
    if (meshcat or steered_by is not None) and type(run).live is Run.live:
        raise ScenarioError(
            f"meshcat: found with the kind {kind}; accepted: with kinds that move a robot; "
            "replay.html shows the run afterwards"
        )
    if listens and not meshcat:
        raise ScenarioError("host, port: found alone; accepted: with meshcat")
    if meshcat and steered_by is not None:
        raise ScenarioError("meshcat, steered_by: found together; accepted: one of them")


def _write_inputs(run: Run, results: Folder) -> None:
    with results.files() as stage:
        run.write_inputs(stage)


def _exports(
    run: Run, results: Folder, formats: Sequence[str], video: bool
) -> Mapping[str, Callable[[Path], object]]:
    """Writers of the log in further formats, and of the film."""
    exports: dict[str, Callable[[Path], object]] = dict(log_exports(results.path, formats))
    if video:
        exports[FILM] = partial(write_film, run)
    return exports


def _in_meshcat(run: Run, host: str, port: int | None, follow: Follow) -> Callable[..., None]:
    meshcat = open_meshcat(host, port)
    follow.say(f"{run.scenario.name} at {page_address(meshcat, host)}")
    show: Any = run.live(meshcat)
    return lambda _, simulator, diagram: show(simulator, diagram)
