"""A motion in proven sets, of any kind: its numbers, its accelerations, exact checks of samples."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.planning.plans import Plan
from cdpr_drake.analyses.visualization.curves import draw_curve
from cdpr_drake.analyses.visualization.figure_style import bare_figure, line_style, styled
from cdpr_drake.analyses.workspaces.proven_sets import ProvenSets
from cdpr_drake.arrays import Array
from cdpr_drake.palette import BOUND, nth_look
from cdpr_drake.planning.box_timing import BoxTiming, inertial_terms, mass_of
from cdpr_drake.planning.path_timing import PathPlan
from cdpr_drake.workspaces.proven_sets import PoseSets
from cdpr_drake.workspaces.timed_sets import TimedSets

JUDGED = 2000
"""Samples of a motion that are judged by the exact checks of poses."""

SETS = "sets.yaml"
"""The sets, in Drake's format of regions; of sets of poses and time the last number is time."""

POINTS = 400
"""Points of curves."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class MotionInSets(Plan):
    """A motion in proven sets, of any kind.

    Attributes:
        solution: The motion as one of the robot.
        sets_time: Time that the sets took [s].
        judged: Samples of the motion, and of each kind of check at how many it fails by the exact
            checks of poses.
    """

    solution: PathPlan
    sets_time: float
    judged: tuple[int, Mapping[str, int]]

    @property
    @abstractmethod
    def sets(self) -> PoseSets | TimedSets:
        """The sets."""

    @abstractmethod
    def proof(self) -> tuple[list[str], list[str]]:
        """What is proven at every instant, and what is not, in words."""

    def kept_at_samples(self) -> list[str]:
        """What the motion keeps only at samples, in words."""
        lim, (by_move, by_turn) = self.task.limits, self.task.dynamics.damping
        lines = []
        if np.isfinite(lim.torque) or np.isfinite(lim.cable_acceleration):
            lines.append("torques of motors and accelerations of cables, kept at samples")
        if self.task.dynamics.is_damped:
            lines.append(
                f"tensions against the platform's damping, {by_move:g} N s/m and {by_turn:g} N m "
                "s/rad, kept at samples"
            )
        return lines

    def description(self) -> list[str]:
        """Length and cost, what is proven and what is not, and exact checks of samples."""
        details, (count, failed) = self.details(), self.judged
        proven, unit = details["proven"], "s" if details["least"] == "time" else "m"
        path = "the path" if proven["path"] else "CABLES ALONE"
        what = "the motion" if proven["motion"] else path
        wrong = sum(failed.values())
        return [
            f"{details['duration_s']:.4f} s along {details['path_length_m']:.4g} m, in "
            f"{len(details['stretches'])} of {details['sets']['count']} proven sets",
            f"least {details['least']}: {details['cost']:.4g} {unit}, no less than "
            f"{details['lower_bound']:.4g} {unit} in these sets; straight "
            f"{details['straight_m']:.4g} m",
            f"proven at every instant: {what}",
            *(f"waits from {wait['from_s']:.4g} to {wait['to_s']:.4g} s"
              for wait in details.get("waits", [])),
            *(f"  {line}" for line in proven["of"]),
            *(f"  not proven: {line}" for line in proven["not_of"]),
            f"{count} samples by the checks of poses: "
            f"{'all kinds hold' if not wrong else f'{wrong} FAIL'}",
        ]  # fmt: skip

    def write(self, folder: Folder) -> None:
        """Writes the sets, too."""
        with folder.file(SETS) as part:
            self.sets.save(part)
        super().write(folder)


def judged(sets: ProvenSets, plan: PathPlan, count: int) -> tuple[int, dict[str, int]]:
    """Samples of a motion, evenly in time, and of each kind at how many it fails exactly."""
    motion = plan.trajectory
    poses = [motion.pose(t) for t in np.linspace(motion.start_time, motion.end_time, count)]
    holds = sets.judge(
        np.array([X.translation() for X in poses]),
        np.array([X.rotation().matrix() for X in poses]),
    )
    return count, {name: int(np.count_nonzero(~each)) for name, each in holds.items()}


def acceleration_figure(plan: MotionInSets, box: BoxTiming | None = None) -> Figure:
    """Accelerations over time with the box for which tensions are proven; of a turn moments, too.

    Without turns they are those of Po, with turns those of the centre of mass.
    """
    motion, about = plan.motion, plan.sets.about
    times = np.linspace(motion.start_time, motion.end_time, 2 * POINTS)
    rows = np.array([motion.motion(t) for t in times])
    limits = np.array(about["accelerations_m_s2"])
    if box is None or box.moments is None:
        panels = [(rows[:, 16:19], limits, "acceleration in W [m/s²]")]
        of = "Acceleration of Po in the proven box"
    else:
        _, terms = inertial_terms(rows, *mass_of(plan.task))
        panels = [
            (terms[:, :3], limits, "acceleration in W [m/s²]"),
            (terms[:, 3:], np.array(about["moments_n_m"]), "moment in P [N m]"),
        ]
        of = "Acceleration of the centre of mass, and moment about it, in the proven boxes"
    figure = bare_figure((10.0, 5.0 + 3.5 * (len(panels) - 1)), f"{of}\n{plan.title}")
    with styled():
        grid = figure.subplots(len(panels), 1, squeeze=False, sharex=True)
        for axes, (values, halves, label) in zip(grid[:, 0], panels, strict=True):
            _draw_in_box(axes, times, values, halves)
            axes.set_ylabel(label)
        grid[-1, 0].set_xlabel("time [s]")
    return figure


def _draw_in_box(axes: Any, times: Array, values: Array, halves: Array) -> None:
    for k in range(3):
        look = nth_look(k)
        draw_curve(axes, times, values[:, k], look, f"along {'xyz'[k]}", phase=(k + 0.5) / 3)
    for number, bound in enumerate(np.unique(halves)):
        for side in (-bound, bound):
            name = "proven box" if side > 0.0 and number == 0 else None
            axes.axhline(side, label=name, **line_style(BOUND))
    axes.margins(x=0.01)
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))


def thick(look: Any) -> dict[str, Any]:
    """Style of a path."""
    return line_style(look) | {"linewidth": 2.4, "marker": ""}
