"""`cdpr simulate`: runs a scenario and writes what it did, or repeats a visual servo over seeds.

`simulate` is the command, `simulate_once` one run. With --seeds `simulate_seeds` runs many in
several processes.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Protocol

import numpy as np
import typer
from rich.table import Table

from cdpr_drake.analyses.reporting.deferred_figures import write_pictures
from cdpr_drake.analyses.reporting.exported_logs import checked_log_formats, log_exports
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.analyses.reporting.log_on_disk import CHECKPOINT, PARTS, LogOnDisk
from cdpr_drake.analyses.reporting.output_folder import (
    ResultsFolder,
    continued_folder,
    results_folder,
    resumed_folder,
    unfinished_folder,
)
from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.analyses.reporting.provenance import write_run_inputs
from cdpr_drake.analyses.simulation.live_control import Steering
from cdpr_drake.analyses.simulation.live_messages import open_connection
from cdpr_drake.analyses.simulation.monte_carlo import run_many, with_seeds
from cdpr_drake.analyses.simulation.monte_carlo_report import (
    repetition_pictures,
    repetition_table,
    write_repetitions,
)
from cdpr_drake.analyses.simulation.monte_carlo_store import StoredRuns, repetition_folder
from cdpr_drake.analyses.simulation.scenario_kinds import SCENARIO_KINDS, ScenarioKind
from cdpr_drake.analyses.simulation.session import Progress, RunSession, check_connected
from cdpr_drake.analyses.sweeps.workers import check_scheduler
from cdpr_drake.analyses.visualization.live_view import Prepare
from cdpr_drake.analyses.visualization.meshcat_window import LOCAL, open_meshcat, page_address
from cdpr_drake.cli.completion import scenario_words, words_among
from cdpr_drake.cli.options import FigureFormats, Host, Overwrite, Port, Scheduler, parse_formats
from cdpr_drake.cli.process import INTERRUPTED, StopRequest
from cdpr_drake.cli.run_endings import (
    CLIENT_ENDED,
    INCOMPLETE,
    SayContinued,
    report_failures,
    report_kept_files,
    report_recovered,
    shown_path,
)
from cdpr_drake.cli.terminal import message_console, print_json, progress_bar, wide_console, working
from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import set_loop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.remote.remote_place import Remote
from cdpr_drake.systems.scenarios.files import scenario_kind
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO, Scenario

STOPPING = "Stopping: log and summary are written; Ctrl-C again ends this now"
"""Answer to the first Ctrl-C while a run goes on."""

PICTURES = "Stopping after the picture that is being written; Ctrl-C again ends this now"
"""Answer to the first Ctrl-C where the run is over."""


def simulate(
    scenario: Annotated[
        str,
        typer.Argument(
            help="Scenario by name, path of a YAML file, or folder of a run, to repeat it.",
            autocompletion=scenario_words,
        ),
    ] = DEFAULT_SCENARIO,
    out: Annotated[
        Path | None,
        typer.Option(help="Results folder; without it, a new one below runs/."),
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(
            help="rendered or projected.", autocompletion=words_among(("rendered", "projected"))
        ),
    ] = None,
    duration: Annotated[float | None, typer.Option(help="Longest simulated time [s].")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of noise and random directions.")] = None,
    seeds: Annotated[
        str | None,
        typer.Option(help="Repeats the run over seeds, as 0:20 (0 to 19) or 3,5,8."),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(help="Processes for --seeds; without it, one for each processor.", min=1),
    ] = None,
    scheduler: Scheduler = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", help="key=value of the scenario, such as controller.lambda_0=1.5."),
    ] = None,
    overwrite: Overwrite = False,
    figure_format: FigureFormats = "png",
    video: Annotated[bool, typer.Option(help="Render camera.mp4 too.")] = False,
    finish: Annotated[
        Path | None,
        typer.Option(help="Makes log, summary and figures of what a killed run left in a folder."),
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option(
            "--continue",
            help="Goes on with a run that was killed, from its last checkpoint, in its folder.",
        ),
    ] = None,
    log_rate: Annotated[
        float | None,
        typer.Option(help="Rows of the log per second [Hz]; long runs need few."),
    ] = None,
    log_format: Annotated[
        str | None,
        typer.Option(
            help="The log also as mat (MATLAB) or parquet, or both: mat,parquet; log.csv and "
            "log.npz are always there."
        ),
    ] = None,
    meshcat: Annotated[
        bool, typer.Option(help="Show the run in a browser, at real time at most.")
    ] = False,
    host: Host = None,
    port: Port = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
    steered_by: Annotated[
        int | None,
        typer.Option(help="Open socket of the program that follows and steers it.", hidden=True),
    ] = None,
) -> int:
    """Simulates a scenario and writes summary, log, figures and replay."""
    left = finish or resume
    if left is not None:
        given: list[object] = [out, camera, duration, seed, seeds, workers, settings, host, port]
        given += [overwrite or None, meshcat or None, log_rate, finish and resume, scheduler]
        given += [steered_by]
        if scenario != DEFAULT_SCENARIO or any(option is not None for option in given):
            raise ScenarioError(
                f"--{'continue' if finish is None else 'finish'}: accepted with --format, "
                "--log-format, --video and --json only"
            )
        exports = () if log_format is None else checked_log_formats(log_format)
        formats = parse_formats(figure_format)
        wanted = RunOutputs(left, False, exports, formats, video, None, as_json)
        return _finish(left, wanted) if resume is None else _continue(left, wanted)
    kind = SCENARIO_KINDS[scenario_kind(scenario)]
    overrides, formats = list(settings or []), parse_formats(figure_format)
    _refuse(
        (
            not kind.has_camera and (camera is not None or video),
            f"scenario {scenario}: has no camera; leave out --camera and --video",
        ),
        (
            kind.has_camera and not kind.is_servo and video,
            f"scenario {scenario}: --video: accepted for visual servos only",
        ),
        (seeds is None and workers is not None, "--workers: accepted with --seeds only"),
        (seeds is None and scheduler is not None, "--scheduler: accepted with --seeds only"),
        (
            workers is not None and scheduler is not None,
            "--workers, --scheduler: accepted one without the other",
        ),
        (
            seeds is not None and (not kind.is_servo or seed is not None or video),
            "--seeds: accepted for visual servos, without --seed and --video",
        ),
        (
            seeds is not None and (meshcat or log_format is not None),
            "--seeds: accepted without --meshcat and --log-format",
        ),
        (
            steered_by is not None and (seeds is not None or meshcat),
            "--steered-by: accepted without --seeds and --meshcat",
        ),
        (
            not meshcat and (host is not None or port is not None),
            "--host, --port: accepted with --meshcat only",
        ),
    )
    repeated = None if seeds is None else parse_seeds(seeds)
    exports = () if log_format is None else checked_log_formats(log_format)
    for key, value in (
        ("camera.kind", camera), ("duration", duration), ("seed", seed), ("log_rate", log_rate)
    ):  # fmt: skip
        if value is not None:
            overrides.append(f"{key}={value}")
    loaded, note = set_loop(
        load_scenario(scenario, overrides), repeated is not None, watched=meshcat
    )
    check_connected(loaded, None)
    if repeated is not None:
        _say_warnings(kind, loaded, "")
        return simulate_seeds(
            loaded, repeated, scheduler or workers, out, overwrite, as_json,
            formats=formats, note=note,
        )  # fmt: skip
    folder = out if out is not None else free_folder(Path("runs") / loaded.name)
    listens = (host or LOCAL, port) if meshcat else None
    wanted = RunOutputs(folder, overwrite, exports, formats, video, listens, as_json, steered_by)
    return simulate_once(kind, loaded, wanted, note)


class Outside(Protocol):
    """A process outside that closes the loop of a run."""

    def connect(self, remote: Remote) -> None:
        """Brings it to its place."""

    def tell_end(self, result: Any) -> None:
        """Tells it how the run ended."""


@dataclass(frozen=True)
class RunOutputs:
    """What of one run goes where; `listens` are host and port of Meshcat, if it is wanted, and
    `steered_by` is the open socket of a program that steers it."""

    folder: Path
    overwrite: bool
    exports: tuple[str, ...]
    formats: Sequence[str]
    video: bool
    listens: tuple[str, int | None] | None
    as_json: bool
    steered_by: int | None = None


def _refuse(*rules: tuple[bool, str]) -> None:
    """Refuses options that do not go together."""
    for broken, words in rules:
        if broken:
            raise ScenarioError(words)


def simulate_once(
    kind: ScenarioKind,
    scenario: Any,
    wanted: RunOutputs,
    note: str,
    outside: Callable[[StopRequest], Outside] | None = None,
) -> int:
    """One run: checks it, simulates it, writes its data and then its pictures.

    Args:
        kind: Its kind.
        scenario: The scenario.
        wanted: What goes where.
        note: What is said before it starts; empty: nothing.
        outside: Makes what brings a process to its place in the loop; None: nobody is outside.
    """
    console = message_console()
    stop = StopRequest(STOPPING)
    with stop.listening(), results_folder(wanted.folder, wanted.overwrite) as results:
        report_recovered(console, results)
        _say_warnings(kind, scenario, note)
        write_run_inputs(results.path, scenario, load_robot(scenario.robot))
        live = None if wanted.listens is None else _live(kind, scenario, *wanted.listens)
        if wanted.steered_by is not None:
            live = _steered(scenario, wanted.steered_by, stop)
        other = None if outside is None else outside(stop)
        code = _run(kind, scenario, wanted, results, stop, live=live, outside=other)
    report_kept_files(console, results.kept)
    return code


def _continue(folder: Path, wanted: RunOutputs) -> int:
    """Goes on with a run from the last checkpoint that it left in a folder."""
    stop = StopRequest(STOPPING)
    with stop.listening(), resumed_folder(folder) as results:
        file = str(results.path / "scenario.yaml")
        kind = SCENARIO_KINDS[scenario_kind(file)]
        return _run(kind, load_scenario(file), wanted, results, stop, resume=True)


def _run(
    kind: ScenarioKind,
    scenario: Any,
    wanted: RunOutputs,
    results: ResultsFolder,
    stop: StopRequest,
    *,
    live: Prepare | None = None,
    resume: bool = False,
    outside: Outside | None = None,
) -> int:
    """Simulates into a folder, from the start or from a checkpoint; writes data, then pictures."""
    console = message_console()
    with progress_bar(console) as bar:
        task = bar.add_task(scenario.name, total=scenario.duration, state="starting")

        def show(progress: Progress) -> None:
            factor = progress.sim_time / max(progress.wall_time, 1e-9)
            bar.update(
                task,
                completed=progress.sim_time,
                state=f"{progress.sim_time:5.1f} s, {factor:.1f} x real time, error "
                f"{1e3 * progress.position_error:6.1f} mm "
                f"{np.degrees(progress.rotation_error):5.1f} deg",
            )

        connect = None if outside is None else outside.connect
        session = RunSession(show, stop, results.path / PARTS, live, resume, connect)
        result = kind.run(scenario, session)
        if outside is not None:
            outside.tell_end(result)
    interrupted = result.outcome == Outcome.INTERRUPTED
    goes_on = interrupted and (results.path / PARTS / CHECKPOINT).is_file()
    with working(console, "Writing results") as say:
        summary = kind.data(results.path, result)
        if not goes_on:
            result.log.remove()  # now that the log is written; it stays readable here
        folder = shown_path(results.publish())
        failed = write_pictures(
            folder,
            log_exports(folder, wanted.exports)
            | kind.pictures(result, wanted.video, wanted.formats),
            lambda name: say(f"Writing {name}"),
            stop,
        )
    _print_summary(summary, kind, folder, wanted.as_json)
    if interrupted:
        more = f"; to go on: cdpr simulate --continue {shlex.quote(str(folder))}" if goes_on else ""
        console.print(
            f"Interrupted at {result.sim_time:g} s of simulated time; "
            f"what was simulated is in {folder}{more}",
            soft_wrap=True, markup=False, highlight=False,
        )  # fmt: skip
        return INTERRUPTED
    code = report_failures(console, failed, folder, stop)
    if result.outcome == Outcome.CLIENT_ENDED and code != INTERRUPTED:
        console.print(
            f"cdpr: the run ended at {result.sim_time:g} s of simulated time: {result.message}; "
            f"what was simulated is in {folder}",
            soft_wrap=True, markup=False, highlight=False,
        )  # fmt: skip
        return CLIENT_ENDED
    return code


def _finish(folder: Path, wanted: RunOutputs) -> int:
    """Makes log, summary and figures of what a run left in a folder that did not end by itself."""
    console = message_console()
    stop = StopRequest(PICTURES)
    with stop.listening(), unfinished_folder(folder) as found:
        scenario = str(found / "scenario.yaml")
        kind = SCENARIO_KINDS[scenario_kind(scenario)]
        log = LogOnDisk.open(found / PARTS)
        with working(console, "Writing results") as say:
            result = kind.unfinished(load_scenario(scenario), log)
            summary = kind.data(found, result)
            log.remove()
            failed = write_pictures(
                found,
                log_exports(found, wanted.exports)
                | kind.pictures(result, wanted.video, wanted.formats),
                lambda name: say(f"Writing {name}"),
                stop,
            )
    _print_summary(summary, kind, shown_path(found), wanted.as_json)
    return report_failures(console, failed, shown_path(found), stop)


def _say_warnings(kind: ScenarioKind, scenario: Any, note: str) -> None:
    """Checks a scenario before it is simulated, and says a note and what speaks against it."""
    with working(message_console(), f"{scenario.name}: building the diagram"):
        warnings = kind.check(scenario)
    if note:
        message_console().print(note)
    for warning in warnings:
        message_console().print(f"warning: {warning}")


def _live(kind: ScenarioKind, scenario: Any, host: str, port: int | None) -> Prepare:
    """Opens Meshcat and says where."""
    meshcat = open_meshcat(host, port)
    message_console().print(f"{scenario.name} at {page_address(meshcat, host)}")
    return kind.live(scenario, meshcat)


def _steered(scenario: Any, descriptor: int, stop: StopRequest) -> Prepare:
    """Lets who holds the other end of a socket steer a run."""
    connection = open_connection(descriptor)
    return Steering(scenario, connection, should_stop=stop, ask_stop=stop.ask).prepare


def _print_summary(
    summary: dict[str, Any], kind: ScenarioKind, folder: Path, as_json: bool
) -> None:
    if as_json:
        print_json(summary)
        return
    table = Table(title=f"{summary['scenario']}: {summary['outcome']}", show_header=False)
    factor = summary["realtime_factor"] or 0.0
    table.add_row("simulated", f"{summary['sim_time_s']:.2f} s, {factor:.1f} x real time")
    for label, words in kind.facts(summary):
        table.add_row(label, words)
    table.add_row("results", str(folder))
    if summary["message"]:
        table.add_row("message", summary["message"])
    wide_console().print(table)


STOPPING_REPETITIONS = "Stopping after the runs under way, which are kept; Ctrl-C again drops them"
"""Answer to the first Ctrl-C while runs over seeds go on."""

LARGEST_SEED = 2**31 - 1
MOST_RUNS = 100_000


def parse_seeds(words: str) -> list[int]:
    """Seeds from "0:20" (20 not included) or "3,5,8".

    Raises:
        ScenarioError: It is neither, there are none, or one is there twice.
    """
    span = re.fullmatch(r"(\d{1,10}):(\d{1,10})", words)
    if span and int(span[2]) - int(span[1]) <= MOST_RUNS:
        seeds = list(range(int(span[1]), int(span[2])))
    elif re.fullmatch(r"\d{1,10}(,\d{1,10})*", words):
        seeds = [int(word) for word in words.split(",")]
    else:
        seeds = []
    if not seeds or len(set(seeds)) < len(seeds) or max(seeds) > LARGEST_SEED:
        raise ScenarioError(
            f"--seeds: found {words!r}; accepted: first:end, as 0:20 for 0 to 19, or different "
            f"seeds separated by commas, up to {LARGEST_SEED} and {MOST_RUNS} of them"
        )
    return seeds


def simulate_seeds(
    scenario: Scenario,
    seeds: list[int],
    workers: int | str | None,
    out: Path | None,
    overwrite: bool,
    as_json: bool,
    *,
    formats: Sequence[str],
    note: str,
) -> int:
    """Repeats a scenario, shows where it stands, and writes what came out.

    By so many processes, or by the workers of the Dask scheduler of that address. What was finished
    is kept in the folder whatever ends the program, and found again there.
    """
    count, scheduler = (None, workers) if isinstance(workers, str) else (workers, None)
    if scheduler is not None:
        check_scheduler(scheduler)
    folder = out if out is not None else repetition_folder(scenario)
    console = message_console()
    robot = load_robot(scenario.robot)
    stop = StopRequest(STOPPING_REPETITIONS)
    with stop.listening(), continued_folder(folder, overwrite) as results:
        kept = StoredRuns(results.path, scenario)
        if note:
            console.print(note)
        with progress_bar(console) as bar:
            task = bar.add_task(scenario.name, total=len(seeds), state="starting processes")

            say_continued = SayContinued(bar.console, folder)

            def show(progress: WorkProgress) -> None:
                say_continued(progress)
                bar.update(
                    task,
                    completed=progress.done,
                    state=f"{progress.done} of {progress.total} runs, "
                    f"{60.0 * progress.speed:.0f} a minute, {progress.what}",
                )

            runs = run_many(
                with_seeds(scenario, seeds), count, show, stop,
                keep_traces=True, kept=kept, scheduler=scheduler,
            )  # fmt: skip
        with working(console, "Writing results"):
            summary = write_repetitions(results.path, scenario, runs, robot)
            folder = shown_path(results.publish())
            failed = write_pictures(folder, repetition_pictures(scenario, runs, formats))
    report_kept_files(console, results.kept)
    if as_json:
        print_json(summary)
    else:
        printer = wide_console(100)
        printer.print(repetition_table(summary))
        printer.print(f"{summary['wall_time_s']:.1f} s; results: {folder}")
    if runs.interrupted:
        console.print(
            f"Interrupted; {len(runs.records)} of {runs.wanted} runs are in {folder}; the same "
            "command with that --out continues"
        )
        return INTERRUPTED
    if runs.lost:
        dead = ", ".join(map(str, runs.lost))
        console.print(f"cdpr: seed {dead}: the process died, perhaps out of memory")
    return max(report_failures(console, failed, folder, stop), INCOMPLETE if runs.lost else 0)
