"""Figures of a plan: phase plane and limits reached, tensions, winches, the path in space."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.planning.plan_results import MotionRun, PlanRun
from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.visualization.cable_figures import cable_figure, draw_cables
from cdpr_drake.analyses.visualization.curves import draw_bars
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS, figure_writers
from cdpr_drake.analyses.visualization.figure_style import (
    COVERED_LINE,
    bare_figure,
    line_style,
    styled,
)
from cdpr_drake.analyses.visualization.path_figures import Path3D, path_figure
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import BOUND, DESIRED, DISTANCE, IDEAL, PLATFORM, Look, nth_look
from cdpr_drake.planning.margin_kernel import TENSION_USE
from cdpr_drake.planning.path_task import MotionSamples, sample_motion
from cdpr_drake.planning.resistance import wrench_words

CROWDED = 24
"""Rows of limits that a figure shows; of more, those that are reached longest."""


def plan_pictures(run: PlanRun, formats: Sequence[str] = DEFAULT_FORMATS) -> Pictures:
    """What draws the figures of a plan, by the names of their files."""
    drawn: dict[str, Callable[[], Figure]] = {
        "phase_plane": lambda: phase_figure(run),
        "tensions": lambda: tension_figure(run),
        "winches": lambda: winch_figure(run),
        "path": lambda: plan_path_figure(run),
    }
    if run.resisted is not None:
        drawn["resistance"] = lambda: resistance_figure(run)
    return dict(figure_writers(drawn, formats))


def _title(run: MotionRun, words: str) -> str:
    return f"{words}\n{run.about}"


def reached_rows(robot: Robot, samples: MotionSamples) -> list[tuple[str, Look, Array]]:
    """Limits that are reached: name, look, and whether it is at each sample, shape (n,)."""
    rows: list[tuple[str, Look, Array]] = []
    for name, holds in samples.active().items():
        for k in range(holds.shape[1]):
            if not np.any(holds[:, k]):
                continue
            whole = holds.shape[1] == len(robot.cables)
            cable = f"{robot.cables[k].name} " if whole else ""
            rows.append((f"{cable}{name}", nth_look(k) if whole else PLATFORM, holds[:, k]))
    longest = sorted(range(len(rows)), key=lambda i: -float(np.sum(rows[i][2])))[:CROWDED]
    return [rows[i] for i in sorted(longest)]


def phase_figure(run: PlanRun) -> Figure:
    """Speed along the path below the largest speeds, and which limits are reached where."""
    plan, samples = run.plan, run.samples
    rows = reached_rows(run.robot, samples)
    height = 0.8 + 0.24 * max(len(rows), 1)
    title = _title(run, "Speed along the path, and the limits that it reaches")
    figure = bare_figure((11.0, 5.6 + height), title)
    stations = plan.trajectory.stations
    with styled():
        axes, bars = figure.subplots(2, 1, sharex=True, height_ratios=(4.6, height))
        top = np.sqrt(plan.largest)
        axes.plot(
            stations, np.sqrt(plan.reachable[:, 1]),
            label="largest from which the end can be reached",
            **COVERED_LINE | {"color": DESIRED.color, "marker": ""},
        )  # fmt: skip
        axes.plot(stations, top, label="largest at this point by itself", **line_style(BOUND))
        axes.plot(samples.parameters, samples.speeds, label="plan", **line_style(DISTANCE))
        most = float(np.max(samples.speeds))
        axes.set_ylim(0.0, min(float(np.nanmax(top, initial=most)), 2.5 * most) * 1.05)
        axes.set(ylabel="ds/dt [m/s]")
        axes.legend(loc="lower center")
        draw_bars(bars, samples.parameters, rows)
        bars.set(
            xlabel="way s along the path [m], turns by the length scale", ylabel="limit reached"
        )
        axes.margins(x=0.01)
    return figure


def tension_figure(run: MotionRun) -> Figure:
    """Tensions with the limits that the plan keeps: where one is reached, there is no choice."""
    samples, lim = run.samples, run.samples.limits
    log = {
        "time": samples.times,
        "tensions": samples.tensions,
        "slack": np.zeros(samples.tensions.shape),
    }
    words = "Tensions of the plan, as far from their limits as can be"
    return cable_figure(
        _title(run, words), run.robot, log, "tensions", "tension [N]",
        bounds=(round(lim.lower, 3), round(lim.upper, 3)),
    )  # fmt: skip


def winch_figure(run: MotionRun) -> Figure:
    """Speeds and accelerations of the cables, and torques of the motors, with their limits."""
    samples, lim = run.samples, run.samples.limits
    shown: list[tuple[str, Array, float]] = [
        ("cable speed [m/s]", samples.cable_speeds, lim.cable_speed),
        ("cable acceleration [m/s²]", samples.cable_accelerations, lim.cable_acceleration),
    ]
    if np.all(np.isfinite(samples.torques)):
        shown.append(("motor torque [N m]", samples.torques, lim.torque))
    figure = bare_figure(
        (11.0, 1.2 + 3.0 * len(shown)), _title(run, "What the plan asks of winches")
    )
    with styled():
        places: Any = figure.subplots(len(shown), 1, sharex=True)
        for number, (place, (label, values, bound)) in enumerate(zip(places, shown, strict=True)):
            draw_cables(place, run.robot, samples.times, values)
            if bound <= 2.0 * float(np.max(np.abs(values))):
                for side in (-bound, bound):
                    style = line_style(BOUND) | {"linewidth": 1.2, "zorder": 1}
                    place.axhline(side, label="limit" if side > 0.0 else None, **style)
            place.set(ylabel=label)
            place.margins(x=0.01)
            if number == 0:
                place.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        places[-1].set(xlabel="time [s]")
    return figure


def resistance_figure(run: PlanRun) -> Figure:
    """What the motion leaves of tensions and torques, alone and under the wrenches to resist."""
    found, samples = run.resisted, run.samples
    assert found is not None
    assert samples.resisted is not None
    alone = sample_motion(replace(run.task, resist=np.empty((0, 6))), run.motion, samples.times)
    figure = bare_figure((11.0, 4.6), _title(run, "What is left under the wrenches to resist"))
    worst = wrench_words(found.corners[found.worst])
    with styled():
        axes = figure.subplots()
        s = samples.parameters
        axes.plot(s, 1.0 - alone.uses[:, TENSION_USE], label="motion alone", **line_style(IDEAL))
        label = f"with the worst of {len(found.corners)} wrenches at each point"
        axes.plot(s, 1.0 - samples.resisted, label=label, **line_style(DISTANCE))
        axes.plot(
            found.parameters, found.margins, "o", markersize=4.0, color="black",
            markerfacecolor="none", label="each wrench where it is worst",
        )  # fmt: skip
        axes.plot(
            found.parameters[found.worst], found.margins[found.worst], "D", color="black",
            label=f"the worst: {worst}",
        )  # fmt: skip
        axes.axhline(0.0, label="limit", **line_style(BOUND))
        axes.set(
            xlabel="way s along the path [m], turns by the length scale",
            ylabel="margin, share of half the range [-]",
        )
        axes.margins(x=0.01)
        axes.legend(loc="best")
    return figure


def plan_path_figure(run: MotionRun) -> Figure:
    """Where the platform goes: the plan, and the simulated robot where it was tracked."""
    way = run.motion.path
    assert way is not None
    points = way.points(np.linspace(0.0, way.length, 400))
    paths = [Path3D(points[:, 4:7], "Po of the plan", DESIRED)]
    rows = points[:, :7]
    if run.tracked is not None:
        rows = run.tracked.log["X_WP"]
        paths.append(Path3D(rows[:, 4:], "Po of the simulated robot", PLATFORM))
    log = {"X_WP": rows, "slack": np.zeros((len(rows), len(run.robot.cables)))}
    return path_figure(_title(run, "Path of the platform"), run.robot, run.task.cables, log, paths)
