"""`cdpr simulate`: runs a scenario and writes what it did, or repeats a visual servo over seeds."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.table import Table

from cdpr_drake.analyses.front.simulation import RepeatedRuns, Run, continue_run, finish_run
from cdpr_drake.analyses.front.simulation import simulate as run_scenario
from cdpr_drake.analyses.reporting.exported_logs import checked_log_formats
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.analyses.simulation.break_report import REACTIONS
from cdpr_drake.analyses.simulation.live_control import Steering
from cdpr_drake.analyses.simulation.live_messages import open_connection
from cdpr_drake.analyses.simulation.monte_carlo_report import repetition_table
from cdpr_drake.analyses.simulation.monte_carlo_store import repetition_folder
from cdpr_drake.analyses.simulation.scenario_kinds import SCENARIO_KINDS, ScenarioKind
from cdpr_drake.analyses.simulation.session import Progress
from cdpr_drake.analyses.visualization.live_view import Prepare
from cdpr_drake.analyses.visualization.meshcat_window import LOCAL, open_meshcat, page_address
from cdpr_drake.cli.command_session import CommandSession, shown
from cdpr_drake.cli.completion import scenario_words, words_among
from cdpr_drake.cli.options import (
    LISTENING,
    FigureFormats,
    Host,
    Overwrite,
    Port,
    Scheduler,
    named_options,
    parse_formats,
)
from cdpr_drake.cli.process import INTERRUPTED
from cdpr_drake.cli.reactions import tell_reactions
from cdpr_drake.cli.run_endings import CLIENT_ENDED, INCOMPLETE, report_failures
from cdpr_drake.cli.terminal import print_json, wide_console
from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import set_loop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.files import scenario_kind
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO

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
        typer.Option(help="Results folder; default: a new one below runs/."),
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
        typer.Option(
            help="Processes for --seeds; default: one for each processor, for long work.", min=1
        ),
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
        typer.Option(
            help="Folder of a killed run: write log, summary and figures of what it left."
        ),
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option(
            "--continue",
            help="Folder of a killed run: continue it from its last checkpoint.",
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
    compare: Annotated[
        int | None,
        typer.Option(
            "--compare-reactions",
            help="Number of a cable, from 0: break it once for each reaction and compare the "
            "runs; goes with --set, --camera, --seed, --out and --json.",
        ),
    ] = None,
    break_time: Annotated[
        float | None,
        typer.Option(help="With --compare-reactions: time of the break [s]; default 1."),
    ] = None,
    after: Annotated[
        float | None,
        typer.Option(
            help="With --compare-reactions: time simulated after the break [s]; default 2."
        ),
    ] = None,
    reactions: Annotated[
        str | None,
        typer.Option(
            help="With --compare-reactions: one or several, separated by commas; default all: "
            + ", ".join(REACTIONS)
            + "."
        ),
    ] = None,
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
        given += [steered_by, compare]
        if scenario != DEFAULT_SCENARIO or any(option is not None for option in given):
            raise ScenarioError(
                f"--{'continue' if finish is None else 'finish'}: accepted with --format, "
                "--log-format, --video and --json only"
            )
        wanted = {
            "log_formats": _log_formats(log_format), "formats": parse_formats(figure_format),
            "video": video,
        }  # fmt: skip
        return _left(left, resume is not None, as_json, wanted)
    of_break = {"time": break_time, "after": after, "reactions": reactions}
    if compare is not None:
        others = {
            "--duration": duration, "--seeds": seeds, "--workers": workers, "--video": video,
            "--scheduler": scheduler, "--log-rate": log_rate, "--log-format": log_format,
            "--meshcat": meshcat, "--host": host, "--port": port, "--steered-by": steered_by,
        }  # fmt: skip
        _refuse(*(
            (value not in (None, False), f"{name}: accepted without --compare-reactions")
            for name, value in others.items()
        ))  # fmt: skip
        return tell_reactions(
            scenario, compare, of_break, out,
            overrides=_overrides(settings, {"camera.kind": camera, "seed": seed}),
            formats=parse_formats(figure_format), overwrite=overwrite, as_json=as_json,
        )  # fmt: skip
    _refuse(*(
        (value is not None, f"{name}: accepted with --compare-reactions only")
        for name, value in zip(
            ("--break-time", "--after", "--reactions"), of_break.values(), strict=True
        )
    ))  # fmt: skip
    kind = SCENARIO_KINDS[scenario_kind(scenario)]
    formats = parse_formats(figure_format)
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
            kind.live is None and (meshcat or steered_by is not None),
            f"scenario {scenario}: --meshcat: found with the kind {scenario_kind(scenario)}; "
            "accepted: with kinds that move a robot; replay.html shows the run afterwards",
        ),
        (
            not meshcat and (host is not None or port is not None),
            "--host, --port: accepted with --meshcat only",
        ),
    )
    repeated = None if seeds is None else parse_seeds(seeds)
    exports = _log_formats(log_format)
    overrides = _overrides(
        settings,
        {"camera.kind": camera, "duration": duration, "seed": seed, "log_rate": log_rate},
    )
    loaded = load_scenario(scenario, overrides)
    if repeated is not None:
        folder = out if out is not None else repetition_folder(set_loop(loaded, True)[0])
        many = RepetitionSession(STOPPING_REPETITIONS, folder, loaded.name, len(repeated))
        with many:
            runs = run_scenario(
                loaded, folder=folder, seeds=repeated, workers=scheduler or workers,
                overwrite=overwrite, formats=formats, session=many,
            )  # fmt: skip
        return _tell_repetitions(runs, many, as_json)
    folder = out if out is not None else free_folder(Path("runs") / loaded.name)
    listens = (host or LOCAL, port) if meshcat else None
    with SimulationSession(STOPPING, folder, listens, steered_by) as session:
        found = run_scenario(
            loaded, folder=folder, overwrite=overwrite, formats=formats, log_formats=exports,
            video=video, session=session,
        )  # fmt: skip
        code = tell_run(found, session, as_json)
    session.say_kept()
    return code


def _overrides(settings: list[str] | None, given: dict[str, object]) -> list[str]:
    """Items of --set, and those of options that were given."""
    more = [f"{key}={value}" for key, value in given.items() if value is not None]
    return [*(settings or []), *more]


def _left(folder: Path, goes_on: bool, as_json: bool, wanted: dict[str, Any]) -> int:
    """Goes on with a run that was killed, or makes results of what it left."""
    with SimulationSession(STOPPING if goes_on else PICTURES, folder) as session:
        if goes_on:
            return tell_run(continue_run(folder, session=session, **wanted), session, as_json)
        found = finish_run(folder, session=session, **wanted)
        _print_summary(found, shown(found.folder), as_json)
        return report_failures(session.console, found.failed, shown(found.folder), session.request)


def _log_formats(words: str | None) -> tuple[str, ...]:
    names = [] if words is None else [word.strip() for word in words.split(",")]
    with named_options({"log_formats": "--log-format"}):
        return checked_log_formats(names)


def _refuse(*rules: tuple[bool, str]) -> None:
    """Refuses options that do not go together."""
    for broken, words in rules:
        if broken:
            raise ScenarioError(words)


class SimulationSession(CommandSession):
    """What a terminal shows of a run, and who else takes part in it."""

    def __init__(
        self,
        stopping: str,
        folder: Path,
        listens: tuple[str, int | None] | None = None,
        steered_by: int | None = None,
    ) -> None:
        """Of a run.

        Args:
            stopping: Answer to the first Ctrl-C.
            folder: Where results go.
            listens: Host and port of Meshcat, if it is wanted.
            steered_by: The open socket of a program that steers it.
        """
        super().__init__(stopping, folder)
        self.watched = listens is not None
        self._listens, self._steered_by = listens, steered_by

    def fields(self, progress: Progress) -> dict[str, Any]:
        """Of the bar."""
        factor = progress.sim_time / max(progress.wall_time, 1e-9)
        return {
            "completed": progress.sim_time,
            "state": f"{progress.sim_time:5.1f} s, {factor:.1f} x real time, error "
            f"{1e3 * progress.position_error:6.1f} mm "
            f"{np.degrees(progress.rotation_error):5.1f} deg",
        }

    def prepare(self, kind: ScenarioKind, scenario: Any) -> Prepare | None:
        """Opens Meshcat and says where, or lets who holds the other end of a socket steer."""
        self.name, self.total = scenario.name, scenario.duration
        if self._steered_by is not None:
            with named_options({"descriptor": "--steered-by"}):
                connection = open_connection(self._steered_by)
            request = self.request
            return Steering(scenario, connection, should_stop=request, ask_stop=request.ask).prepare
        if self._listens is None:
            return None
        host, port = self._listens
        with named_options(LISTENING):
            meshcat = open_meshcat(host, port)
        self.say(f"{scenario.name} at {page_address(meshcat, host)}")
        return None if kind.live is None else kind.live(scenario, meshcat)


def tell_run(found: Run, session: SimulationSession, as_json: bool) -> int:
    """Prints what a run did, and returns the exit code."""
    console, folder, result = session.console, shown(found.folder), found.result
    _print_summary(found, folder, as_json)
    if result.outcome == Outcome.INTERRUPTED:
        again = f"; to go on: cdpr simulate --continue {shlex.quote(str(folder))}"
        console.print(
            f"Interrupted at {result.sim_time:g} s of simulated time; "
            f"what was simulated is in {folder}{again if found.goes_on else ''}",
            soft_wrap=True, markup=False, highlight=False,
        )  # fmt: skip
        return INTERRUPTED
    code = report_failures(console, found.failed, folder, session.request)
    if result.outcome == Outcome.CLIENT_ENDED and code != INTERRUPTED:
        console.print(
            f"cdpr: the run ended at {result.sim_time:g} s of simulated time: {result.message}; "
            f"what was simulated is in {folder}",
            soft_wrap=True, markup=False, highlight=False,
        )  # fmt: skip
        return CLIENT_ENDED
    return code


def _print_summary(found: Run, folder: Path, as_json: bool) -> None:
    summary = found.numbers
    if as_json:
        print_json(summary)
        return
    table = Table(title=f"{summary['scenario']}: {summary['outcome']}", show_header=False)
    factor = summary["realtime_factor"] or 0.0
    table.add_row("simulated", f"{summary['sim_time_s']:.2f} s, {factor:.1f} x real time")
    table.add_row("cables", summary["geometry"])
    for label, words in found.facts():
        table.add_row(label, words)
    for words in summary.get("remarks", ()):
        table.add_row("remark", words)
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


class RepetitionSession(CommandSession):
    """What a terminal shows of runs over seeds."""

    def fields(self, progress: WorkProgress) -> dict[str, Any]:
        """Of the bar."""
        return {
            "completed": progress.done,
            "state": f"{progress.done} of {progress.total} runs, "
            f"{60.0 * progress.speed:.0f} a minute, {progress.what}",
        }


def _tell_repetitions(found: RepeatedRuns, session: RepetitionSession, as_json: bool) -> int:
    """Prints what runs over seeds did, and returns the exit code."""
    console, folder, runs = session.console, shown(found.folder), found.runs
    session.say_kept()
    if as_json:
        print_json(found.numbers)
    else:
        printer = wide_console(100)
        printer.print(repetition_table(found.numbers))
        printer.print(f"{found.numbers['wall_time_s']:.1f} s; results: {folder}")
    if runs.interrupted:
        console.print(
            f"Interrupted; {len(runs.records)} of {runs.wanted} runs are in {folder}; the same "
            "command with that --out continues"
        )
        return INTERRUPTED
    if runs.lost:
        dead = ", ".join(map(str, runs.lost))
        console.print(f"cdpr: seed {dead}: the process died, perhaps out of memory")
    code = report_failures(console, found.failed, folder, session.request)
    return max(code, INCOMPLETE if runs.lost else 0)
