"""The study: its runs, tables, figure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import Cell, Summary
from cdpr_drake.analyses.studies.schemes import trials
from cdpr_drake.analyses.studies.schemes.statements import CHECKS
from cdpr_drake.analyses.studies.schemes.trials import (
    FREE,
    PERIOD,
    ROBOT,
    TURNS,
    TURNS_DEG,
    VARIANTS,
    free_starts,
    measure,
    robot_starts,
)
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.palette import nth_look

STARTS, QUICK_STARTS = 100, 8
"""Drawn starts of a free camera and of ACROBOT, each."""

DRAWN = {"ibvs", "pbvs-line", "partitioned", "partitioned, turned", "switching"}
"""Schemes in the panels over turns; pbvs and 2.5d do there what pbvs-line does."""

NOTHING = 1e-5
"""Retreat that is drawn where there is none, or less [m]."""

LOOKS = {scheme: nth_look(k) for k, scheme in enumerate(VARIANTS)}


def cases(form: Form) -> Iterator[Case]:
    """Each scheme on each turn, once, and from drawn starts, whose numbers are seeds."""
    for scheme in VARIANTS:
        for turn in TURNS_DEG:
            keys = {"trial": TURNS, "scheme": scheme, "turn_deg": turn}
            yield Case(name=f"{TURNS}, {scheme}, {turn} deg", keys=keys, most=1)
    for trial in (FREE, ROBOT):
        for scheme in VARIANTS:
            yield Case(name=f"{trial}, {scheme}", keys={"trial": trial, "scheme": scheme})


def parameters(form: Form) -> Mapping[str, Any]:
    """Constants of the trials, and the starts that are drawn."""
    count = form.asked_seeds or (QUICK_STARTS if form.quick else STARTS)
    kinds = (str, int, float, tuple, dict)
    constants = {name: one for name, one in vars(trials).items() if name.isupper()}
    return {
        **{name.lower(): one for name, one in constants.items() if isinstance(one, kinds)},
        "free_starts": [pose_row(X_CO).tolist() for X_CO in free_starts(count)],
        "robot_starts": robot_starts(count),
    }


def figure(runs: Runs) -> Figure:
    """Retreats and depths on turns, failures from drawn starts."""
    drawn, axes = new_figure(2, 2, (14.0, 10.0), "Schemes of visual servoing")
    _draw_retreats(axes[0, 0], runs)
    _draw_turn(axes[0, 1], runs)
    for axis, trial in ((axes[1, 0], FREE), (axes[1, 1], ROBOT)):
        _draw_failures(axis, runs, trial)
    return drawn


def _turns(runs: Runs, **where: Any) -> Iterator[tuple[str, Runs]]:
    """Turns of the schemes that are drawn."""
    for scheme in VARIANTS:
        if scheme in DRAWN and runs.has(trial=TURNS, scheme=scheme, **where):
            yield scheme, runs(trial=TURNS, scheme=scheme, **where)


def _draw_retreats(axis: Axes, runs: Runs) -> None:
    """How far the camera retreats on a turn, by its angle."""
    for scheme, some in _turns(runs):
        look, retreat = LOOKS[scheme], np.maximum(some["retreat_m"], NOTHING)
        axis.semilogy(some["turn_deg"], retreat, label=scheme, **line_style(look),
                      marker=look.marker, markersize=4)  # fmt: skip
    axis.set(xlabel="turn about the optical axis [deg]",
             ylabel=f"retreat [m]; at $10^{{{np.log10(NOTHING):.0f}}}$: none",
             title="How much farther than start and goal the camera goes")  # fmt: skip
    if axis.get_legend_handles_labels()[0]:
        axis.legend()


def _draw_turn(axis: Axes, runs: Runs) -> None:
    """Depth over time on the largest turn."""
    for scheme, some in _turns(runs, turn_deg=TURNS_DEG[-1]):
        (depths,) = some.list("depths_m")
        times = PERIOD * np.arange(len(depths))
        axis.semilogy(times, depths, label=scheme, **line_style(LOOKS[scheme]))
    axis.set(xlabel="time [s]", ylabel="depth of the dots [m]", ylim=(0.03, 10.0),
             title=f"A turn by {TURNS_DEG[-1]} deg")  # fmt: skip


def _draw_failures(axis: Axes, runs: Runs, trial: str) -> None:
    """Shares of runs that lost the target or did not arrive, side by side."""
    there = dict(runs(trial=trial).by("scheme")) if runs.has(trial=trial) else {}
    for place, (scheme, some) in enumerate(there.items()):
        gone = 100.0 * np.mean(some["lost"])
        short = 100.0 * np.mean(~some["arrived"] & ~some["lost"])
        axis.bar(place, gone, color=LOOKS[scheme].color, edgecolor="black")
        axis.bar(place, short, bottom=gone, color="white", edgecolor="black", hatch="//")
        axis.annotate(f"{gone:.0f} + {short:.0f}", (place, gone + short), ha="center",
                      va="bottom")  # fmt: skip
    axis.set_xticks(range(len(there)), list(there), rotation=30, ha="right", rotation_mode="anchor")
    axis.set(ylabel="runs [%]", title=f"{trial}: target lost (full) + not there (hatched)")
    axis.set_ylim(0.0, max(5.0, 1.2 * axis.get_ylim()[1]))


def _switched(runs: Runs) -> str:
    """How many runs switched, of a scheme that does."""
    switches = runs["switches"]
    return "" if np.all(np.isnan(switches)) else f"{np.sum(switches > 0.0)}"


def _share(runs: Runs) -> str:
    """The largest share of a bound, of a scheme that has one."""
    share = runs["bound_share"]
    return "" if np.all(np.isnan(share)) else f"{np.nanmax(share):.3f}"


STUDY = Study(
    name="schemes",
    title="Schemes of visual servoing beside each other, from the same starts",
    source="servoing thesis 1.4.1",
    cases=cases,
    measure=measure,
    seeds=(STARTS, QUICK_STARTS),
    parameters=parameters,
    checks=CHECKS,
    stated="What is said of them",
    tables=[
        Summary(
            f"{trial}: medians of those that arrived, worst of all",
            ("scheme",),
            {
                "runs": Cell("runs"),
                "arrived": Cell("total", "arrived"),
                "lost": Cell("total", "lost"),
                "time [s]": Cell("median", "time_s", ".2f", {"arrived": True}),
                "image path [px]": Cell("median", "image_path_px", ".0f", {"arrived": True}),
                "worst retreat [m]": Cell("largest", "retreat_m", ".3g"),
                "switched": _switched,
                "share of bound": _share,
            },
            where={"trial": trial},
        )
        for trial in (TURNS, FREE, ROBOT)
    ],
    figures={"schemes": figure},
)
