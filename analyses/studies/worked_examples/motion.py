"""The Gazebo thesis' trajectory by two programs, and by its printed coefficients."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

START, END = np.array([0.0, -2.0, 2.0]), np.array([3.0, 1.0, 3.0])
"""Gazebo thesis 6.2, at rest in both, platform unturned [m]."""

DURATION = 100.0
"""Gazebo thesis 6.2 [s]."""

SAMPLES = 201
"""Moments at which programs are compared."""


@dataclass(frozen=True, eq=False)
class SampledMotion:
    """A motion at moments of `times`.

    Attributes:
        times: From the start, shape (n,) [s].
        positions: Shape (n, 3) [m].
        velocities: Shape (n, 3) [m/s].
        accelerations: Shape (n, 3) [m/s^2].
    """

    times: Array
    positions: Array
    velocities: Array
    accelerations: Array

    def parts(self) -> tuple[Array, Array, Array]:
        """Positions, velocities and accelerations."""
        return self.positions, self.velocities, self.accelerations


def by_trajectory() -> SampledMotion:
    """By the class that moves simulated robots."""
    poses = tuple(pose_from_angles(place, np.zeros(3)) for place in (START, END))
    trajectory = PoseTrajectory(poses, (DURATION,))
    times = np.linspace(0.0, DURATION, SAMPLES)
    rows = np.array([trajectory.motion(float(time)) for time in times])
    return SampledMotion(times, rows[:, 4:7], rows[:, 10:13], rows[:, 16:19])


def by_conditions() -> SampledMotion:
    """By a second program: the six conditions (6.9) to (6.14) as equations in six coefficients."""
    powers = np.arange(6)
    rows = []
    for time in (0.0, DURATION):
        for order in range(3):
            factors = np.ones(6)
            for k in range(order):
                factors = factors * (powers - k)
            exponents = np.maximum(powers - order, 0)
            rows.append(factors * np.power(time, exponents))
    still = np.zeros(3)
    wanted = np.array([START, still, still, END, still, still])
    return _sampled(np.linalg.solve(np.array(rows), wanted))


def by_printed_coefficients() -> SampledMotion:
    """By (6.16) to (6.21) as they are printed, for a motion from rest to rest."""
    way = END - START
    third = 20.0 * way / (2.0 * DURATION**3)
    fourth = 30.0 * way / (2.0 * DURATION**4)
    fifth = 12.0 * way / (2.0 * DURATION**5)
    return _sampled(np.array([START, np.zeros(3), np.zeros(3), third, fourth, fifth]))


def _sampled(coefficients: Array) -> SampledMotion:
    """Polynomials with coefficients c_k of t^k, shape (6, 3)."""
    p = np.polynomial.polynomial
    times = np.linspace(0.0, DURATION, SAMPLES)
    x, v, a = (
        np.asarray(p.polyval(times, p.polyder(coefficients, order)), np.float64).T
        for order in range(3)
    )
    return SampledMotion(times, x, v, a)
