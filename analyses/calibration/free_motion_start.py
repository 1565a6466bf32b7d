"""Coordinates of a first state in which a search for a free motion goes straight.

Cables are so stiff that a tenth of a millimetre is many sigmas of tension. A search in poses and
unstrained lengths, which have to change together, then follows a valley that bends on millimetres,
and takes hundreds of steps. Coordinates here are instead the tensions that the cables have at the
first instant, as far as the pose tells them apart, the motions that no cable feels, and the rates:
lengths and stiffness may change, and what is pulled at the beginning stays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from scipy.spatial.transform import Rotation

from cdpr_drake.analyses.calibration.free_motion_model import FreeMotionModel
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import cross_matrix

MOVED = np.array([0.5] * 3 + [0.3] * 3 + [5.0] * 3 + [2.0] * 3)
"""How far a state may usually be from rest: turn [rad], translation [m], their rates."""


def moved_sizes(moved: Array) -> Array:
    """`MOVED`, and 1 for each number behind it: shares of what contacts can be bent by."""
    return np.concatenate([MOVED, np.ones(len(moved) - len(MOVED))])


FELT = 1e-6
"""Share of the largest singular value from which on cables feel a motion."""

MOST_EXPONENT = 50.0
"""Of stiffening cables: beyond it a search is lost, and numbers shall not be infinite."""

ROUNDS, SETTLED = 12, 1e-13
"""Newton's steps for a pose, and where they end [rad, m]."""


@dataclass(frozen=True, eq=False)
class StartCoordinates:
    """Coordinates of the first state of one stretch, shape (12,) and what contacts remember.

    Attributes:
        model: The robot.
        near: First state about which they are made; `MOVED`'s shape and units.
        pulls: Combinations of cables that a pose feels, shape (m, r).
        free: Motions that none feels, in sizes of `MOVED`, shape (6, 6 - r).
        unit: What a coordinate of one stretches the cables by, at the stiffness believed [m].
    """

    model: FreeMotionModel
    near: Array
    pulls: Array
    free: Array
    unit: float

    @staticmethod
    def about(model: FreeMotionModel, near: Array) -> StartCoordinates:
        """About a first state, see `FreeMotionModel.run`.

        Raises:
            CableGeometryError: A cable cannot run there.
        """
        cables = model.cables
        paths = cable_paths(_pose(model, near), cables)
        U, s, V = np.linalg.svd(paths.J * MOVED[:6])
        r = int(np.count_nonzero(s > FELT * s[0]))
        weight = model.robot.platform.mass * np.linalg.norm(model.robot.gravity_vector())
        stiff = float(np.mean(cables.stiffness / paths.lengths))
        unit = float(weight / stiff) if weight > 0.0 else 1e-3
        return StartCoordinates(model, near, U[:, :r], V[r:].T, unit)

    def of(self, vector: Array, moved: Array) -> Array:
        """Coordinates of a first state at a vector of unknowns.

        Raises:
            CableGeometryError: A cable cannot run there.
        """
        off, _ = self._stretches(vector, moved)
        return np.concatenate(
            [
                self.pulls.T @ self._by_tension(vector, off) / self.unit,
                self.free.T @ (moved[:6] / MOVED[:6]), moved[6:] / moved_sizes(moved)[6:],
            ]
        )  # fmt: skip

    def moved(self, vector: Array, y: Array) -> Array:
        """The first state of coordinates; NaN where none is found."""
        r = self.pulls.shape[1]
        found = np.concatenate([self.near[:6], y[6:] * moved_sizes(y)[6:]])
        goal = y[:r] * self.unit
        if self._stiffens(vector):
            goal = self.pulls.T @ self._by_stretch(vector, self.pulls @ goal)
        try:
            for _ in range(ROUNDS):
                off, J = self._stretches(vector, found)
                lacking = np.concatenate(
                    [goal - self.pulls.T @ off, y[r:6] - self.free.T @ (found[:6] / MOVED[:6])]
                )
                slopes = np.vstack([self.pulls.T @ J, self.free.T / MOVED[:6]])
                step = np.linalg.solve(slopes, lacking)
                found[:6] += step
                if np.max(np.abs(step)) < SETTLED:
                    break
        except (CableGeometryError, np.linalg.LinAlgError):
            return np.full(len(y), np.nan)
        return found

    def _stretches(self, vector: Array, moved: Array) -> tuple[Array, Array]:
        """How far cables are stretched at a first state, times how stiff they are beside what is
        believed, shape (m,) [m], and its derivatives by rotation vector and translation, (m, 6)."""
        model = self.model
        cables = model.cables
        share = model.by_name(vector)["all.stiffness"] / float(np.mean(cables.stiffness))
        paths = cable_paths(_pose(model, moved), cables)
        J = np.hstack([paths.J[:, :3] @ _turning(moved[:3]), paths.J[:, 3:]])
        return share * (paths.lengths - model.lengths(vector)), share * J

    def _stiffens(self, vector: Array) -> bool:
        """Whether cables stiffen, and the pose feels each of them: then stretches that stay would
        have tensions of another exponential at each step, and the valley would bend again."""
        apart = self.pulls.shape[0] == self.pulls.shape[1]
        return apart and self.model.behaviour(vector).stiffening > 0.0

    def _by_tension(self, vector: Array, off: Array) -> Array:
        """How far linear cables would be stretched by the tensions of stretches, shape (m,) [m]."""
        if not self._stiffens(vector):
            return off
        EA, g, l0 = self._law(vector)
        x = np.minimum(g * EA * np.maximum(off, 0.0) / l0, MOST_EXPONENT)
        return np.asarray(np.expm1(x) * l0 / (EA * g) + np.minimum(off, 0.0))

    def _by_stretch(self, vector: Array, off: Array) -> Array:
        """The inverse of `_by_tension`."""
        EA, g, l0 = self._law(vector)
        x = np.log1p(g * EA * np.maximum(off, 0.0) / l0)
        return np.asarray(x * l0 / (EA * g) + np.minimum(off, 0.0))

    def _law(self, vector: Array) -> tuple[Array, float, Array]:
        """Stiffnesses as they are believed [N], as the stretches are scaled to, stiffening [1/N],
        unstrained lengths [m]."""
        model = self.model
        return (
            model.cables.stiffness, model.behaviour(vector).stiffening,
            model.lengths(vector),
        )  # fmt: skip


def _turning(v: Array) -> Array:
    """By which small turns in W follow from changes of a rotation vector, shape (3, 3)."""
    angle, S = float(np.linalg.norm(v)), cross_matrix(v)
    if angle < 1e-4:
        return np.asarray(np.eye(3) + 0.5 * S + S @ S / 6.0, float)
    first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * S + second * S @ S, float)


def _pose(model: FreeMotionModel, moved: Array) -> RigidTransform:
    turn = RotationMatrix(Rotation.from_rotvec(moved[:3]).as_matrix())
    return RigidTransform(turn @ model.start.rotation(), model.start.translation() + moved[3:6])
