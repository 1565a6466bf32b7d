"""Track: follow a place that moves along sines, at home's orientation.

Along each direction of motion the reference is s(t) A sin(w t + phi) from home, begun at rest, with
A, w and phi of the episode. The reward is that of `reach_task`, with distance and angle from the
reference.
"""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.learning.reach_task import ReachTask
from cdpr_drake.analyses.learning.robot_task import TaskOptions
from cdpr_drake.analyses.learning.task_kernel import LENGTH, SPEED, write_references
from cdpr_drake.arrays import Array

RAMP = 2.0
"""Time in which the reference comes into motion [s]."""

AMPLITUDES = (0.2, 0.5)
"""Of the reach, between which amplitudes are drawn."""

SPEED_LIMIT = 0.5
"""Of full speed, which the sines of all directions together keep, after the ramp."""

MOST_RATE = 2.0 * np.pi * 0.5
"""Largest angular frequency of a sine [rad/s]."""


class TrackTask(ReachTask):
    """The observation ends with where the reference is (6), its velocity and acceleration (6)."""

    def __init__(self, count: int, options: TaskOptions) -> None:
        """As `RobotTask`."""
        super().__init__(count, options)
        k = self.box.directions.shape[1]
        self._amplitudes, self._rates, self._phases = np.zeros((3, count, k))
        self._reference = np.zeros((count, 3, k))

    def _aimed(self) -> int:
        return 12

    def _begin(self, row: int, random: np.random.Generator) -> RigidTransform:
        k = self.box.directions.shape[1]
        A = self.reach * random.uniform(*AMPLITUDES, k)
        most = np.minimum(SPEED_LIMIT * self.scales[SPEED] / (np.sqrt(k) * A), MOST_RATE)
        self._amplitudes[row], self._rates[row] = A, most * random.uniform(0.5, 1.0, k)
        self._phases[row] = random.uniform(-np.pi, np.pi, k)
        return self.box.home

    def _look(self, rows: np.ndarray, moved: bool) -> None:
        write_references(
            self.batch.times, self._amplitudes, self._rates, self._phases, RAMP, self._reference
        )
        offset, velocity, acceleration = self._in_world()
        self._goals[:, 4:] = self._home_row[4:] + offset
        super()._look(rows, moved)
        own, speed = self._own(), self.scales[SPEED]
        own[:, 6:9] = velocity / speed
        own[:, 9:12] = acceleration * (self.scales[LENGTH] / speed**2)

    def _in_world(self) -> tuple[Array, Array, Array]:
        """Offset from home, velocity and acceleration, each of shape (count, 3)."""
        whole = np.zeros((3, self.count, 3))
        for k, direction in enumerate(self.box.directions.T):
            whole = whole + self._reference[:, :, k].T[:, :, None] * direction
        return whole[0], whole[1], whole[2]

    def motions(self) -> tuple[Array, Array, Array]:
        """Place, velocity and acceleration of the reference now, each of shape (count, 3)."""
        offset, velocity, acceleration = self._in_world()
        return self._home_row[4:] + offset, velocity, acceleration
