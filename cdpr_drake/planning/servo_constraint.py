"""A visual servo that converges at a pose although its model is wrong, as a constraint."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.straight_cables import ALL_ROWS, PLANAR_ROWS
from cdpr_drake.planning.pose_constraint import PoseConstraint
from cdpr_drake.planning.pose_coordinates import Coordinates
from cdpr_drake.planning.pose_coordinates_kernel import SEEDS
from cdpr_drake.planning.servo_margin_kernel import MULTIPLES, servo_margins
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds, vector_size
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import VerdictOptions, packed_case, worst_perturbations

STEP = 1e-3
"""Of the differences over the pose: they miss by its fourth power [rad, m]."""


class StableServo(PoseConstraint):
    """A servo is stable with given perturbations of its model: a row for each of them [-].

    A row is the least eigenvalue of (Pi + Pi') / 2, see `stability.criterion`; above 0 the servo
    converges. The eigenvector is exact, but the criterion's change with the pose is a difference of
    fourth order over `STEP`, since the interaction matrices have no derivative in closed form here.

    Some perturbations are not all: ask `stability.judge_stability` at what was found, and add the
    worst there by `worst_at` if it says no.

    Source: servoing thesis (3.1), (3.26).
    """

    description = "servo"

    def __init__(
        self,
        case: StabilityCase,
        bounds: PerturbationBounds,
        coordinates: Coordinates,
        perturbations: Array | None = None,
        least: float = 0.0,
    ) -> None:
        """With the servo and what its model may miss.

        Args:
            case: Robot without pulleys, scheme, target.
            bounds: What limits the perturbations.
            coordinates: As of the base class.
            perturbations: As of `stability.perturbation_bounds`, shape (k, 18 + 6 m); None: none,
                where every servo of the right model has 1.
            least: Least margin.

        Raises:
            PlanningError: The perturbations have another shape.
        """
        size = vector_size(case.m)
        rows = np.zeros((1, size)) if perturbations is None else np.atleast_2d(perturbations)
        if rows.shape[1] != size:
            raise PlanningError(
                f"perturbations: found shape {rows.shape}; accepted: (k, {size}) for {case.m} "
                "cables"
            )
        k = len(rows)
        words = [f"perturbation {i + 1}" for i in range(k)]
        super().__init__(coordinates, np.full(k, least), np.full(k, np.inf), words)
        self._case, self._bounds = case, bounds
        self._perturbations = np.ascontiguousarray(rows, float)
        self._directions = np.array(PLANAR_ROWS if case.planar else ALL_ROWS, np.int64)

    @staticmethod
    def worst_at(
        case: StabilityCase,
        bounds: PerturbationBounds,
        poses: Array,
        options: VerdictOptions | None = None,
    ) -> Array:
        """The worst perturbations that a search finds at poses, rows of `pose_row`, shape (N, 7).

        Raises:
            StabilityError: As `stability.worst_perturbations`.
        """
        return worst_perturbations(case, bounds, poses, options)[1]

    def at_points(self, points: Array, extra: Array) -> tuple[Array, Array, Array | None]:
        """As the base class says.

        Raises:
            StabilityError: The target does not give what the scheme needs.
        """
        poses = _neighbours(points[:, :7], self._directions)
        arrays, rows = packed_case(self._case, self._bounds, poses)
        shape = (len(points), len(self._perturbations))
        values, slopes = np.empty(shape), np.empty((*shape, SEEDS))
        servo_margins(arrays, rows, self._perturbations, self._directions, STEP, values, slopes)
        return values, slopes, None


def _neighbours(poses: Array, directions: np.ndarray) -> Array:
    """Poses, each with its neighbours behind it, as `servo_margins` takes them."""
    every = np.repeat(poses[:, np.newaxis], 1 + len(MULTIPLES) * len(directions), axis=1)
    for at, direction in enumerate(directions):
        for near, multiple in enumerate(MULTIPLES):
            row = every[:, 1 + len(MULTIPLES) * at + near]
            if direction >= 3:
                row[:, 1 + direction] += multiple * STEP
                continue
            c, s = np.cos(0.5 * multiple * STEP), np.sin(0.5 * multiple * STEP)
            w, v = row[:, :1].copy(), row[:, 1:4].copy()
            axis = np.zeros(3)
            axis[direction] = s
            row[:, :1] = c * w - (v @ axis)[:, np.newaxis]
            row[:, 1:4] = c * v + w * axis + np.cross(axis, v)
    return every.reshape(-1, 7)
