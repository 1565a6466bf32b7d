"""A free motion with all that is told of it: numbers, distances, a table of the motion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cdpr_drake.analyses.planning.free_motion import FreeSettings, camera_view
from cdpr_drake.analyses.planning.plan_results import MotionRun
from cdpr_drake.analyses.planning.plan_tracking import RATE
from cdpr_drake.arrays import Array
from cdpr_drake.planning.free_path_solution import FreePathSolution
from cdpr_drake.planning.path_task import MotionSamples, PathTask
from cdpr_drake.trajectories.timed_path import TimedPath
from cdpr_drake.workspaces.cable_interference import PART_NAMES, Surroundings, box_row, clearances

LOOKS = 200
"""Instants at which distances and the view are looked at, from start to goal."""

KEPT_WITHIN = 2e-5
"""A distance that is missed by less is kept [m]: plans refine to about half of it."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class FreeRun(MotionRun):
    """A motion of a robot whose path was free.

    Attributes:
        asked: What was asked.
        solution: What the program found.
    """

    asked: FreeSettings
    solution: FreePathSolution

    @property
    def task(self) -> PathTask:
        """The robot as it was planned with."""
        return self.solution.task

    @property
    def motion(self) -> TimedPath:
        """The motion."""
        return self.solution.motion()

    @property
    def about(self) -> str:
        """What it is, in words for titles."""
        took = self.solution.duration
        name = f"{self.robot.name}, {self.geometry}"
        return f"{name}: free path, least {self.asked.least}, {took:.4g} s"

    @cached_property
    def samples(self) -> MotionSamples:
        """The motion, as often as it is controlled."""
        return self.solution.samples(RATE)

    @cached_property
    def looks(self) -> Array:
        """Instants of `distances` and `view`, shape (n,) [s]."""
        return np.linspace(0.0, self.motion.end_time, LOOKS + 1)

    @cached_property
    def distances(self) -> dict[str, Array]:
        """Of cables from each other, and of cables and platform from obstacles, shape (n,) [m].

        Of surfaces, between the knots too; obstacles and platform are their boxes. Empty where no
        clearance is asked for.
        """
        if self.asked.clearance is None:
            return {}
        obstacles = self.asked.solids()
        body = box_row(self.robot.box_center(), self.robot.platform.size)
        around = Surroundings(
            self.task.cables, self.robot.diameters() / 2.0, body[np.newaxis],
            obstacles=obstacles.boxes, solids=obstacles.solids,
        )  # fmt: skip
        poses = [self.motion.pose(t) for t in self.looks]
        found = clearances(
            around,
            np.array([X.translation() for X in poses]),
            np.array([X.rotation().matrix() for X in poses]),
        )
        names = ["cable-cable"]
        if obstacles.shapes():
            names += ["cable-obstacle", "platform"]
        return {name: found[:, PART_NAMES.index(name)] for name in names}

    @cached_property
    def view(self) -> dict[str, Array]:
        """Of each point that shall stay in view: how far inside it is, shape (n,) [-].

        The view's tangent less the point's, over the view's: 1 in the middle, 0 at an edge; below
        0 also where it is nearer than asked. Empty where nothing shall.
        """
        if self.asked.in_view is None:
            return {}
        view = camera_view(self.robot, self.asked.camera)
        cameras = [(self.motion.pose(t) @ view.X_PC).inverse() for t in self.looks]
        found = {}
        for number, point in enumerate(self.asked.in_view.T, 1):
            p = np.array([X @ point for X in cameras])
            inside = 1.0 - np.max(np.abs(p[:, :2]) / np.array(view.slopes) / p[:, 2:], axis=1)
            near = p[:, 2] < self.asked.nearest - KEPT_WITHIN
            found[f"point {number}"] = np.where(near, np.minimum(inside, -1.0), inside)
        return found

    def keeps_asked(self) -> bool:
        """Whether distances and view are as asked between the knots, too."""
        least = 0.0 if self.asked.clearance is None else self.asked.clearance - KEPT_WITHIN
        apart = all(np.min(values) >= least for values in self.distances.values())
        return apart and all(np.min(values) >= -KEPT_WITHIN for values in self.view.values())

    def details(self) -> dict[str, Any]:
        """As the base class says."""
        found = self.solution
        return {
            "duration_s": found.duration,
            "least": self.asked.least,
            "cost": found.cost,
            "solver": found.solver,
            "status": found.status,
            "knots": len(found.times),
            "planning_time_s": self.planning_time,
            "violations": dict(found.violations),
            "between_knots": {
                name: {
                    "missed": one.missed,
                    "missed_at_most": one.bound,
                    "of": one.who,
                    "at_time_s": one.where * found.duration,
                }
                for name, one in found.between.items()
            },
            "least_distances_m": {
                name: float(np.min(values)) for name, values in self.distances.items()
            },
            "least_share_of_view": {
                name: float(np.min(values)) for name, values in self.view.items()
            },
            "keeps_distances_and_view": self.keeps_asked(),
        }
