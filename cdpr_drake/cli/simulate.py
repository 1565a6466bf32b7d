"""`cdpr simulate`: runs a scenario and writes what it did."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from cdpr_drake.analyses.output_folder import free_folder, results_folder
from cdpr_drake.analyses.run import Progress as RunProgress
from cdpr_drake.analyses.run import run_built
from cdpr_drake.analyses.run_files import write_run
from cdpr_drake.systems import build_visual_servo, load_scenario
from cdpr_drake.systems.scenario import DEFAULT_SCENARIO

INTERRUPTED = 130
"""Exit code of a run that Ctrl-C ended, as shells have it."""


class _StopRequest:
    """Turns the first Ctrl-C into a polite request; a second one ends the program."""

    def __init__(self) -> None:
        self.asked = False

    def __call__(self) -> bool:
        return self.asked

    def _ask(self, number: int, frame: FrameType | None) -> None:
        self.asked = True
        signal.signal(signal.SIGINT, signal.default_int_handler)

    @contextmanager
    def listening(self) -> Iterator[None]:
        before = signal.signal(signal.SIGINT, self._ask)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)


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
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", help="key=value of the scenario, such as controller.lambda_0=1.5."),
    ] = None,
    overwrite: Annotated[bool, typer.Option(help="Replace results in the folder.")] = False,
    video: Annotated[bool, typer.Option(help="Render camera.mp4 too.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
) -> int:
    """Simulates a visual servo and writes summary, log, figures and replay."""
    overrides = list(settings or [])
    for key, value in (("camera.kind", camera), ("duration", duration), ("seed", seed)):
        if value is not None:
            overrides.append(f"{key}={value}")
    loaded = load_scenario(scenario, overrides)
    folder = out if out is not None else free_folder(Path("runs") / loaded.name)
    console = Console(stderr=True)
    stop = _StopRequest()
    with results_folder(folder, overwrite) as work:
        with console.status("Building the diagram"):
            servo = build_visual_servo(loaded)
            servo.make_context()
        with stop.listening(), _progress_bar(console) as bar:
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

            result = run_built(servo, show, stop)
        with console.status("Writing results") as status:
            summary = write_run(work, result, video, lambda name: status.update(f"Writing {name}"))
    if as_json:
        print(json.dumps(summary, indent=2))
    else:
        _print_summary(summary, folder)
    if summary["outcome"] == "interrupted":
        console.print(
            f"Interrupted at {result.sim_time:g} s of simulated time; "
            f"what was simulated is in {folder}"
        )
        return INTERRUPTED
    return 0


def _progress_bar(console: Console) -> Progress:
    return Progress(
        BarColumn(bar_width=10),
        TextColumn("{task.fields[state]}"),
        TimeRemainingColumn(compact=True),
        console=console,
        transient=True,
    )


def _print_summary(summary: dict[str, Any], folder: Path) -> None:
    table = Table(title=f"{summary['scenario']}: {summary['outcome']}", show_header=False)
    tension = summary["tension_n"]
    deviation = summary["image_deviation_px"]["max"]
    camera = summary["camera_deviation_m"]["max"]
    for label, words in (
        ("simulated", f"{summary['sim_time_s']:.2f} s, "
                      f"{summary['realtime_factor']:.1f} x real time"),
        ("final error", f"{1e3 * summary['final_position_error_m']:.3f} mm, "
                        f"{np.degrees(summary['final_rotation_error_rad']):.3f} deg"),
        ("pose estimate, error", f"{1e3 * summary['final_pose_estimate_error_m']:.3f} mm, "
                                 f"{np.degrees(summary['final_pose_estimate_error_rad']):.3f} deg"),
        ("from the straight line", ("tag never found" if deviation is None
                                    else f"{deviation:.2f} px in the image")
                                   + f", {1e3 * camera:.1f} mm in space"),
        ("tensions", f"{tension['min']:.2f} to {tension['max']:.2f} N, "
                     f"{summary['slack_cable_seconds']:.1f} cable seconds slack"),
        ("results", str(folder)),
    ):  # fmt: skip
        table.add_row(label, words)
    if summary["message"]:
        table.add_row("message", summary["message"])
    Console().print(table)
