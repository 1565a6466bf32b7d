"""A motion in proven sets, of any kind: what runs at rest and among what moves have in common."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.planning.plan_results import MotionRun
from cdpr_drake.planning.path_task import MotionSamples, PathTask
from cdpr_drake.planning.path_timing import PathPlan
from cdpr_drake.trajectories.timed_path import TimedPath
from cdpr_drake.workspaces.proven_sets import PoseSets
from cdpr_drake.workspaces.timed_sets import TimedSets

SETS = "sets.yaml"
"""The sets, in Drake's format of regions; of sets of poses and time the last number is time."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class RunInSets(MotionRun):
    """A motion of a robot in proven sets.

    Attributes:
        sets_time: Time that the sets took [s].
        judged: Samples of the motion, and of each kind of check at how many it fails by the exact
            checks of poses.
    """

    sets_time: float
    judged: tuple[int, Mapping[str, int]]

    @property
    @abstractmethod
    def plan(self) -> PathPlan:
        """The motion as one of the robot."""

    @property
    @abstractmethod
    def sets(self) -> PoseSets | TimedSets:
        """The sets."""

    @property
    def task(self) -> PathTask:
        """The robot as it was planned with."""
        return self.plan.task

    @property
    def motion(self) -> TimedPath:
        """The motion."""
        return self.plan.trajectory

    @cached_property
    def samples(self) -> MotionSamples:
        """The motion, as often as it is controlled."""
        return self.plan.samples()

    def kept_at_samples(self) -> list[str]:
        """What the motion keeps only at samples, in words."""
        lim, (by_move, by_turn) = self.task.limits, self.task.dynamics.damping
        words = []
        if np.isfinite(lim.torque) or np.isfinite(lim.cable_acceleration):
            words.append("torques of motors and accelerations of cables, kept at samples")
        if self.task.dynamics.is_damped:
            words.append(
                f"tensions against the platform's damping, {by_move:g} N s/m and {by_turn:g} N m "
                "s/rad, kept at samples"
            )
        return words

    def write(self, folder: Path) -> dict[str, Any]:
        """Writes the sets, too."""
        self.sets.save(folder / SETS)
        return super().write(folder)
