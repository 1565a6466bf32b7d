"""`cdpr study planning`: time-optimal along ten paths, without swing, and with foresight.

A plan that is optimal has a limit that is reached at every instant, and takes as long as a fine
convex program of another author says; a plan that is worth something is kept by the simulated
robot, with feedback, at every step of its control. Input shaping is measured by what is left of
the swing on the simulated robot, with cables of rubber and of steel, and on few cables. Predictive
control tracks a quintic motion beside computed torque, at three horizons.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.planning.robot_path_task import RESERVE
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import EMPTY, Cell, Summary
from cdpr_drake.analyses.studies.planning.paths import PATHS, run_path
from cdpr_drake.analyses.studies.planning.predictions import (
    COMPUTED_TORQUE,
    FAST,
    HORIZONS,
    PREDICTIVE,
    SLOW,
    track_quintic,
)
from cdpr_drake.analyses.studies.planning.statements import CHECKS, PATH, SWING, TRACK
from cdpr_drake.analyses.studies.planning.swings import MOTIONS, SHOTS, run_swing
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure
from cdpr_drake.palette import BOUND, DISTANCE
from cdpr_drake.planning.input_shaping import SHAPERS

INTERVALS, QUICK_INTERVALS = 600, 120
"""Of the convex program."""

STATIONS, QUICK_STATIONS = 2000, 500
"""Of the plans. Within the interval of two stations in which a motion switches, no limit need be
reached: the finer, the shorter these are."""

QUICK_PATHS = 2
"""Paths of the quick form."""

QUICK_SWINGS = 1
"""Motions that may swing, of the quick form."""

TRACKS = tuple((duration, steps) for duration in (FAST, SLOW) for steps in (0, *HORIZONS))
QUICK_TRACKS = 2
"""Motions tracked by computed torque (0 steps) and predictive control, and those of the quick
form."""


def cases(form: Form) -> Iterator[Case]:
    """The motions, each once; few of each kind in the quick form, and coarser plans."""
    stations = QUICK_STATIONS if form.quick else STATIONS
    intervals = QUICK_INTERVALS if form.quick else INTERVALS
    for spec in PATHS[:QUICK_PATHS] if form.quick else PATHS:
        yield Case(
            name=f"path {spec.name}",
            keys={
                "kind": PATH, "path": spec.name, "corners": spec.corners, "stations": stations,
                "intervals": intervals,
            },
            data=partial(run_path, spec, stations, intervals),
        )  # fmt: skip
    for number, motion in enumerate(MOTIONS[:QUICK_SWINGS] if form.quick else MOTIONS):
        yield Case(
            name=f"swing {number}",
            keys={"kind": SWING, "motion": motion.name},
            data=partial(run_swing, number),
        )
    for duration, steps in TRACKS[:QUICK_TRACKS] if form.quick else TRACKS:
        controller = PREDICTIVE if steps else COMPUTED_TORQUE
        yield Case(
            name=f"quintic in {duration:g} s, {steps} steps ahead",
            keys={
                "kind": TRACK, "controller": controller, "steps": steps, "duration_s": duration,
            },
            data=partial(track_quintic, duration, steps),
        )  # fmt: skip


def measure(case: Case, seed: int) -> Mapping[str, Any]:
    """What was found of a motion, see `run_path`, `run_swing`, `track_quintic`."""
    found: Mapping[str, Any] = case.data()
    return found


def parameters(form: Form) -> Mapping[str, Any]:
    """What all motions have in common, and the paths."""
    paths = PATHS[:QUICK_PATHS] if form.quick else PATHS
    return {
        "reserve": RESERVE,
        "seeds": [spec.seed for spec in paths],
        "tension_limits_n": [spec.tensions for spec in paths],
        "cable_acceleration_m_s2": [spec.cable_acceleration for spec in paths],
    }


def _shaped(runs: Runs, name: str) -> str:
    """What a way to plan a motion from rest to rest leaves of its swing, and when it ends."""
    left, off, ends = (runs.rows[0][column] for column in ("left_m", "off_m", "end_times_s"))
    if name not in left:
        return EMPTY
    return f"{1e3 * left[name]:.3g} ({1e3 * off[name]:.3g}) mm, {ends[name]:.3g} s"


def phase_planes(runs: Runs) -> Figure:
    """Speeds along all paths below the largest ones."""
    paths = runs(kind=PATH)
    columns = min(len(paths), 5)
    rows = -(-len(paths) // columns)
    size = (3.2 * columns + 1.0, 3.0 * rows + 1.2)
    figure, axes = new_figure(rows, columns, size, "Speed along the paths of the study")
    places = np.atleast_1d(axes).ravel()
    for place, run in zip(places, paths, strict=False):
        stations, speed = run["stations_m"], run["speed_m_s"]
        largest = run["largest_speed_m_s"]
        place.plot(stations, largest, label="largest by itself", **line_style(BOUND))
        place.plot(stations, speed, label="plan", **line_style(DISTANCE))
        place.set_ylim(0.0, 2.0 * float(np.max(speed)))
        place.set_title(f"{run['path']}\n{run['plan_time_s']:.3g} s", fontsize=10)
        place.set(xlabel="s [m]", ylabel="ds/dt [m/s]")
    for place in places[len(paths) :]:
        place.set_axis_off()
    places[0].legend(loc="upper right", fontsize=8)
    return figure


STUDY = Study(
    name="planning",
    title="Time-optimal motions along paths, motions without swing, and predictive control",
    cases=cases,
    measure=measure,
    checks=CHECKS,
    stated="Planning",
    tables=[
        Summary(
            "Time-optimal motions along paths",
            ("path",),
            {
                "time [s]": Cell("mean", "plan_time_s", ".4f"),
                "convex [s]": Cell("mean", "convex_time_s", ".4f"),
                "difference": Cell("mean", "difference", "+.3%"),
                "at a limit": Cell("mean", "reached", ".1%"),
                "tracked: share": Cell("mean", "tracked_share", ".4f"),
                "error [mm]": Cell("mean", "largest_position_error_m", ".3f"),
            },
            where={"kind": PATH},
        ),
        Summary(
            "Rest to rest: largest distance of Po after the command, and when this ends; in "
            "brackets: the stiffness 10 % off; slow: not shaped, in the time of ZVD",
            ("motion",),
            {
                "slowest [Hz]": Cell("mean", "slowest_hz", ".3g"),
                "way [mm]": Cell("mean", "way_m", ".1f"),
                **{name: partial(_shaped, name=name) for name in ("none", *SHAPERS, *SHOTS)},
                "slow [mm]": Cell("mean", "slow_m", ".3g"),
            },
            where={"kind": SWING},
        ),
        Summary(
            "A quintic motion of acrobot_large: distance from it",
            ("controller", "steps", "duration_s"),
            {
                "rms [mm]": Cell("mean", "rms_m", ".3g"),
                "largest [mm]": Cell("mean", "largest_m", ".3g"),
                "without tensions": Cell("total", "failures"),
            },
            where={"kind": TRACK},
        ),
    ],
    figures={"phase_planes": phase_planes},
    parameters=parameters,
    unit="motions",
)
