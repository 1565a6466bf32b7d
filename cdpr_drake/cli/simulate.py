"""`cdpr simulate`: runs a scenario and writes what it did."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from cdpr_drake.analyses.reporting import (
    PARTS,
    LogOnDisk,
    free_folder,
    results_folder,
    unfinished_folder,
    write_pictures,
    write_scenario,
)
from cdpr_drake.analyses.runs import SCENARIO_KINDS, ScenarioKind
from cdpr_drake.analyses.runs import Progress as RunProgress
from cdpr_drake.cli.endings import say_failed, say_recovered, shown_path
from cdpr_drake.cli.options import FigureFormats, Overwrite, parse_formats
from cdpr_drake.cli.repetitions import parse_seeds, simulate_seeds
from cdpr_drake.cli.stop_request import INTERRUPTED, StopRequest
from cdpr_drake.cli.terminal import print_json, progress_bar, wide_console
from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.diagrams import load_scenario
from cdpr_drake.systems.scenarios import DEFAULT_SCENARIO, scenario_kind


def simulate(
    scenario: Annotated[
        str, typer.Argument(help="Scenario by name, or path of a YAML file.")
    ] = DEFAULT_SCENARIO,
    out: Annotated[
        Path | None,
        typer.Option(help="Results folder; without it, a new one below runs/."),
    ] = None,
    camera: Annotated[str | None, typer.Option(help="rendered or projected.")] = None,
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
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
) -> int:
    """Simulates a scenario and writes summary, log, figures and replay."""
    if finish is not None:
        others = (out, camera, duration, seed, seeds, workers, settings, overwrite or None)
        if scenario != DEFAULT_SCENARIO or any(other is not None for other in others):
            raise ScenarioError("--finish: accepted with --format, --video and --json only")
        return finish_run(finish, video, as_json, parse_formats(figure_format))
    kind = SCENARIO_KINDS[scenario_kind(scenario)]
    overrides, formats = list(settings or []), parse_formats(figure_format)
    if not kind.has_camera and (camera is not None or video):
        raise ScenarioError(f"scenario {scenario}: has no camera; leave out --camera and --video")
    if seeds is None and workers is not None:
        raise ScenarioError("--workers: accepted with --seeds only")
    if seeds is not None and (not kind.has_camera or seed is not None or video):
        raise ScenarioError("--seeds: accepted for visual servos, without --seed and --video")
    repeated = None if seeds is None else parse_seeds(seeds)
    for key, value in (("camera.kind", camera), ("duration", duration), ("seed", seed)):
        if value is not None:
            overrides.append(f"{key}={value}")
    loaded = load_scenario(scenario, overrides)
    if repeated is not None:
        _print_warnings(kind.check(loaded))
        return simulate_seeds(loaded, repeated, workers, out, overwrite, as_json, formats=formats)
    folder = out if out is not None else free_folder(Path("runs") / loaded.name)
    console = Console(stderr=True)
    stop = StopRequest()
    with stop.listening(), results_folder(folder, overwrite) as results:
        say_recovered(console, results)
        with console.status("Building the diagram"):
            warnings = kind.check(loaded)
        _print_warnings(warnings)
        write_scenario(results.path / "scenario.yaml", loaded)
        with progress_bar(console) as bar:
            task = bar.add_task(loaded.name, total=loaded.duration, state="starting")

            def show(progress: RunProgress) -> None:
                factor = progress.sim_time / max(progress.wall_time, 1e-9)
                bar.update(
                    task,
                    completed=progress.sim_time,
                    state=f"{progress.sim_time:5.1f} s, {factor:.1f} x real time, error "
                    f"{1e3 * progress.position_error:6.1f} mm "
                    f"{np.degrees(progress.rotation_error):5.1f} deg",
                )

            result = kind.run(loaded, show, stop, results.path / PARTS)
        with console.status("Writing results") as status:
            summary = kind.data(results.path, result)
            result.log.remove()  # now that the log is written; it stays readable here
            folder = shown_path(results.publish())
            failed = write_pictures(
                folder,
                kind.pictures(result, video, formats),
                lambda name: status.update(f"Writing {name}"),
                stop,
            )
    print_summary(summary, kind, folder, as_json)
    if summary["outcome"] == "interrupted":
        console.print(
            f"Interrupted at {result.sim_time:g} s of simulated time; "
            f"what was simulated is in {folder}"
        )
        return INTERRUPTED
    return say_failed(console, failed, folder, stop)


def finish_run(folder: Path, video: bool, as_json: bool, formats: Sequence[str]) -> int:
    """Makes log, summary and figures of what a run left in a folder that did not end by itself."""
    console = Console(stderr=True)
    stop = StopRequest()
    with stop.listening(), unfinished_folder(folder) as found:
        scenario = str(found / "scenario.yaml")
        kind = SCENARIO_KINDS[scenario_kind(scenario)]
        log = LogOnDisk.open(found / PARTS)
        with console.status("Writing results") as status:
            result = kind.unfinished(load_scenario(scenario), log)
            summary = kind.data(found, result)
            log.remove()
            failed = write_pictures(
                found,
                kind.pictures(result, video, formats),
                lambda name: status.update(f"Writing {name}"),
                stop,
            )
    print_summary(summary, kind, shown_path(found), as_json)
    return say_failed(console, failed, shown_path(found), stop)


def print_summary(summary: dict[str, Any], kind: ScenarioKind, folder: Path, as_json: bool) -> None:
    """Prints what a run came to."""
    if as_json:
        print_json(summary)
    else:
        _print_table(summary, kind.facts(summary), folder)


def _print_warnings(warnings: list[str]) -> None:
    for warning in warnings:
        Console(stderr=True, soft_wrap=True).print(
            f"warning: {warning}", markup=False, highlight=False
        )


def _print_table(summary: dict[str, Any], facts: list[tuple[str, str]], folder: Path) -> None:
    table = Table(title=f"{summary['scenario']}: {summary['outcome']}", show_header=False)
    factor = summary["realtime_factor"] or 0.0
    table.add_row("simulated", f"{summary['sim_time_s']:.2f} s, {factor:.1f} x real time")
    for label, words in facts:
        table.add_row(label, words)
    table.add_row("results", str(folder))
    if summary["message"]:
        table.add_row("message", summary["message"])
    wide_console().print(table)
