"""Constraints of tensions and winches, for any MathematicalProgram."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np
from pydrake.solvers import Binding, MathematicalProgram

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.planning.balance_kernel import balances, margins
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.pose_constraint import PoseConstraint
from cdpr_drake.planning.pose_coordinates import Coordinates
from cdpr_drake.planning.pose_coordinates_kernel import SEEDS
from cdpr_drake.planning.rate_kernel import length_accelerations, length_rates

USED = 0.01
"""Share of a limit by which rates may miss it between samples: the reserve of a plan is larger."""


def cable_names(count: int) -> list[str]:
    """Words for cables that have no names."""
    return [f"cable {i + 1}" for i in range(count)]


def check_cables(cables: CableSet) -> None:
    """Refuses cables whose lines have no derivative here.

    Raises:
        PlanningError: They run over pulleys of the platform.
    """
    if cables.has_platform_pulleys():
        raise PlanningError(
            "constraints: found pulleys at the platform; accepted: cables that are fixed there"
        )


class TensionFeasible(PoseConstraint):
    """Some tensions within the limits, less a margin, give the motion; at rest without one.

    One row [N]: the largest s with lower + s <= t <= upper - s and t in balance with weight and
    inertia, see `balance_kernel`; its gradient is exact where it has one. NaN where a cable cannot
    run or the wrench matrix is singular.
    """

    description, highest = "tensions", 2

    def __init__(self, task: PathTask, coordinates: Coordinates, margin: float = 0.0) -> None:
        """With the least margin s [N]."""
        super().__init__(coordinates, np.array([margin]), np.array([np.inf]), ["margin"])
        self._task = task
        self._packed = task.cables.packed(), task.dynamics.packed()
        self._rows = np.array(task.dynamics.motions, np.int64)
        m = task.cables.count
        self._bounds = np.full(m, task.limits.lower), np.full(m, task.limits.upper)

    def at_points(self, points: Array, extra: Array) -> tuple[Array, Array, Array | None]:
        """As the base class says."""
        values, slopes, _ = self._solved(points)
        return values, slopes, None

    def tensions(self, x: Array) -> Array:
        """The tensions that have the margins, of many sets of coordinates, shape (N, m) [N]."""
        points, _ = self.coordinates.points(np.ascontiguousarray(x, float))
        return self._solved(points)[2]

    def AddWithTensions(
        self, prog: MathematicalProgram, variables: Any, tensions: Any = None
    ) -> tuple[Any, Binding]:
        """Adds the same with the tensions as variables of the program, in place of one row.

        Args:
            prog: The program.
            variables: As of `AddTo`.
            tensions: Variables of the tensions as shares of the largest one, shape (m,); None:
                new ones.

        Returns:
            The variables of the tensions, and the balance.
        """
        m, lim = self._task.cables.count, self._task.limits
        if tensions is None:
            tensions = prog.NewContinuousVariables(m, "t")
            low, high = self._bounds[0] / lim.upper, np.ones(m)
            prog.SetInitialGuess(tensions, 0.5 * (low + high))
        gap = float(self.lower[0]) / lim.upper
        low, high = np.full(m, lim.lower / lim.upper + gap), np.full(m, 1.0 - gap)
        prog.AddBoundingBoxConstraint(low, high, tensions)
        balance = TensionBalance(self._task, self.coordinates)
        given = np.concatenate([np.asarray(variables).ravel(), tensions])
        return tensions, balance.AddTo(prog, given)

    def _solved(self, points: Array) -> tuple[Array, Array, Array]:
        N = len(points)
        values, slopes = np.empty((N, 1)), np.empty((N, 1, SEEDS))
        tensions = np.empty((N, self._task.cables.count))
        margins(points, *self._packed, self._rows, *self._bounds, values, slopes, tensions)
        return values, slopes, tensions


class TensionBalance(PoseConstraint):
    """Tensions that are numbers of the program give the motion.

    Rows: wrench of the cables less the one that the motion needs, over the platform's weight. The
    further numbers are the tensions as shares of the largest one.
    """

    description, highest = "dynamics", 2

    def __init__(self, task: PathTask, coordinates: Coordinates) -> None:
        """With the robot and its limits."""
        self._rows = np.array(task.dynamics.motions, np.int64)
        n, self.extra = len(self._rows), task.cables.count
        super().__init__(coordinates, np.zeros(n), np.zeros(n), ())
        self._packed = task.cables.packed(), task.dynamics.packed()
        self._largest = task.limits.upper
        # Where nothing weighs in the platform's plane, newtons are as good.
        weight = task.dynamics.M_PPo_P.get_mass() * task.dynamics.gravity
        self.unit = max(weight, 1.0) if len(self._rows) == 6 else 1.0

    def at_points(self, points: Array, extra: Array) -> tuple[Array, Array, Array | None]:
        """As the base class says."""
        N, n, m = len(points), len(self._rows), self.extra
        values, slopes, columns = np.empty((N, n)), np.empty((N, n, SEEDS)), np.empty((N, n, m))
        tensions = self._largest * extra
        balances(points, *self._packed, self._rows, tensions, values, slopes, columns)
        unit = self.unit
        return values / unit, slopes / unit, columns * (self._largest / unit)


class _LengthChanges(PoseConstraint):
    """A derivative of the cables' lengths by time within a limit: rows of it over that."""

    kept_within = USED
    limited: tuple[str, str]
    """What it is, and its unit, in the words of errors."""

    def __init__(self, cables: CableSet, coordinates: Coordinates, limit: float) -> None:
        """With the largest absolute value, in SI units.

        Raises:
            PlanningError: It is not above 0, or cables run over pulleys of the platform.
        """
        check_cables(cables)
        _check_positive(self.limited[0], limit, self.limited[1])
        one = np.ones(cables.count)
        super().__init__(coordinates, -one, one, cable_names(cables.count))
        self._cables, self._limit = cables.packed(), limit

    def at_points(self, points: Array, extra: Array) -> tuple[Array, Array, Array | None]:
        """As the base class says."""
        values, slopes = self.changes(points)
        return values / self._limit, slopes / self._limit, None

    @abstractmethod
    def changes(self, points: Array) -> tuple[Array, Array]:
        """The derivative, shape (N, m), and its derivatives by the seeds, shape (N, m, 18)."""


class LengthRates(_LengthChanges):
    """Rates of the cables' lengths within a limit [m/s]: rows dl/dt over it."""

    description, order, highest = "cable speeds", 1, 1
    limited = "rate", "m/s"

    def changes(self, points: Array) -> tuple[Array, Array]:
        """As the base class says."""
        shape = (len(points), len(self._cables))
        values, slopes = np.empty(shape), np.empty((*shape, SEEDS))
        length_rates(points, self._cables, values, slopes)
        return values, slopes


class LengthAccelerations(_LengthChanges):
    """Accelerations of the cables' lengths within a limit [m/s^2]: rows d2l/dt2 over it."""

    description, order, highest = "cable accelerations", 2, 2
    limited = "acceleration", "m/s^2"

    def changes(self, points: Array) -> tuple[Array, Array]:
        """As the base class says."""
        return accelerations_of(points, self._cables)


class MotorTorques(PoseConstraint):
    """Torques of the motors within the limit of a task, as of `MotionLimits`: rows over it.

    The further numbers are the tensions as shares of the largest one.
    """

    description, order, highest = "torques", 2, 2

    def __init__(self, task: PathTask, coordinates: Coordinates) -> None:
        """With the robot and its limits."""
        m, lim = task.cables.count, task.limits
        self.extra = m
        super().__init__(coordinates, -np.ones(m), np.ones(m), cable_names(m))
        self._cables = task.cables.packed()
        self._turn = lim.inertia / lim.ratio / lim.torque
        self._pull = lim.ratio * lim.upper / lim.torque

    def at_points(self, points: Array, extra: Array) -> tuple[Array, Array, Array | None]:
        """As the base class says."""
        values, slopes = accelerations_of(points, self._cables)
        columns = np.broadcast_to(
            -self._pull * np.eye(self.extra), (len(points), *2 * (self.extra,))
        )
        return self._turn * values - self._pull * extra, self._turn * slopes, columns


def accelerations_of(points: Array, cables: Array) -> tuple[Array, Array]:
    """d2l/dt2, shape (N, m) [m/s^2], and its derivatives by the seeds, shape (N, m, 18)."""
    shape = (len(points), len(cables))
    values, slopes = np.empty(shape), np.empty((*shape, SEEDS))
    length_accelerations(points, cables, values, slopes)
    return values, slopes


def _check_positive(name: str, value: float, unit: str) -> None:
    if not (np.isfinite(value) and value > 0.0):
        raise PlanningError(f"{name}: found {value:g} {unit}; accepted: above 0")
