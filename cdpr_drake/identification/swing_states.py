"""States of a platform that moves freely: from what sensors tell, and as a search moves them.

Cables are so stiff that a tenth of a millimetre is many sigmas of tension. A search in poses and
unstrained lengths, which have to change together, then follows a valley that bends on millimetres,
and takes hundreds of steps. Coordinates of a first state are instead the tensions that the cables
have then, as far as the pose tells them apart, the motions that no cable feels, and the rates:
lengths and stiffness may change, and what is pulled at the beginning stays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from scipy.spatial.transform import Rotation

from cdpr_drake.arrays import Array
from cdpr_drake.cables.cable_behaviour import strain_of_tension
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.cable_paths import CablePaths, cable_paths
from cdpr_drake.geometry.poses import cross_matrix, pose_from_row
from cdpr_drake.identification.swing_log import Stretch
from cdpr_drake.identification.swing_model import SwingModel, usually_bent

APART = 0.04
"""Time between two readings that tell a velocity: long enough for the noise of turns, short beside
a swing [s]."""

MOVED = np.array([0.5] * 3 + [0.3] * 3 + [5.0] * 3 + [2.0] * 3)
"""Usual distance of a state from rest: turn [rad], translation [m], their rates."""

FELT = 1e-6
"""Share of the largest singular value from which on cables feel a motion."""

MOST_EXPONENT = 50.0
"""Of stiffening cables: beyond it a search is lost, and numbers shall not be infinite."""

STEPS, SETTLED = 12, 1e-13
"""Newton's steps for a pose, and where they end [rad, m]."""

LENGTH_STEPS = 6
"""Gauss's and Newton's steps for a position by lengths."""


def pose_rows_of(turns: Rotation, places: Array) -> Array:
    """Pose rows, shape (n, 7)."""
    return np.hstack([np.atleast_2d(turns.as_quat())[:, [3, 0, 1, 2]], np.atleast_2d(places)])


def paths_of(model: SwingModel, row: Array) -> CablePaths:
    """Paths of the cables at a pose row, shape (7,)."""
    return cable_paths(pose_from_row(row), model.robot.cables)


def first_state(model: SwingModel, vector: Array, stretch: Stretch) -> Array:
    """From rest at the start to the first state, as measured; see `SwingModel.run`."""
    t = stretch.time[0] + model.by_name(vector)["sensor.late"] + np.array([0.0, APART])
    log, start = stretch.log, model.start
    turns, p = model.unsensed(vector, log.turns_at(t), log.positions_at(t))
    w = (turns[1] * turns[0].inv()).as_rotvec() / APART
    if p is not None:
        place, v = p[0], (p[1] - p[0]) / APART
    else:
        unloaded, guess = np.zeros((1, model.robot.cables.count)), start.translation()[None]
        place = places_by_lengths(model, vector, turns[:1], unloaded, guess)[0]
        J = paths_of(model, pose_rows_of(turns[0], place)[0]).J
        v = np.linalg.lstsq(J[:, 3:], -J[:, :3] @ w, rcond=None)[0]
    turn = turns[0] * Rotation.from_matrix(start.rotation().matrix()).inv()
    moved = np.concatenate([turn.as_rotvec(), place - start.translation(), w, v])
    if model.memory:
        moved = np.concatenate([moved, usually_bent(pose_rows_of(turns[0], place)[0], w)])
    return moved


def places_by_lengths(
    model: SwingModel, vector: Array, turns: Rotation, tensions: Array, guesses: Array
) -> Array:
    """Where the cables' lengths under tension put Po, with turns known, shape (n, 3) [m].

    Least squares of the lengths, by Gauss and Newton; NaN where cables cannot run, and for fewer
    than three cables.
    """
    cables, does = model.robot.cables, model.behaviour(vector)
    stiffness = model.by_name(vector)["all.stiffness"]
    EA = cables.stiffness * stiffness / float(np.mean(cables.stiffness))
    l0 = model.lengths(vector) * does.longer()
    rows = pose_rows_of(turns, guesses)
    if cables.count < 3:
        rows[:, 4:] = np.nan
        return rows[:, 4:].copy()
    for row, pulls in zip(rows, tensions, strict=True):
        try:
            for _ in range(LENGTH_STEPS):
                paths = paths_of(model, row)
                strains = strain_of_tension(pulls, EA, does.stiffening)
                lacking = l0 * (1.0 + strains) - paths.lengths
                row[4:] += np.linalg.lstsq(paths.J[:, 3:], lacking, rcond=None)[0]
        except CableGeometryError:
            row[4:] = np.nan
    return rows[:, 4:].copy()


def moved_sizes(moved: Array) -> Array:
    """`MOVED`, and 1 for each number after it: shares of what contacts can be bent by."""
    return np.concatenate([MOVED, np.ones(len(moved) - len(MOVED))])


@dataclass(frozen=True, eq=False)
class StartCoordinates:
    """Coordinates of the first state of one stretch, shape (12,) and what contacts remember.

    Attributes:
        model: The robot.
        near: First state about which they are made; `MOVED`'s shape and units.
        pulls: Combinations of cables that a pose feels, shape (m, r).
        free: Motions that none feels, in sizes of `MOVED`, shape (6, 6 - r).
        unit: How far a coordinate of one stretches the cables, at the believed stiffness [m].
    """

    model: SwingModel
    near: Array
    pulls: Array
    free: Array
    unit: float

    @staticmethod
    def about(model: SwingModel, near: Array) -> StartCoordinates:
        """About a first state, see `SwingModel.run`.

        Raises:
            CableGeometryError: A cable cannot run there.
        """
        cables, platform = model.robot.cables, model.robot.platform
        paths = cable_paths(_pose(model, near), cables)
        U, s, V = np.linalg.svd(paths.J * MOVED[:6])
        r = int(np.count_nonzero(s > FELT * s[0]))
        weight = platform.mass * np.linalg.norm(platform.acceleration())
        stiff = float(np.mean(cables.stiffness / paths.lengths))
        unit = float(weight / stiff) if weight > 0.0 else 1e-3
        return StartCoordinates(model, near, U[:, :r], V[r:].T, unit)

    def of(self, vector: Array, moved: Array) -> Array:
        """Coordinates of a first state at a vector of unknowns.

        Raises:
            CableGeometryError: A cable cannot run there.
        """
        off, _ = self._stretches(vector, moved)
        if self._stiffens(vector):  # how far linear cables would be stretched by these tensions
            EA, g, l0 = self._law(vector)
            x = np.minimum(g * EA * np.maximum(off, 0.0) / l0, MOST_EXPONENT)
            off = np.expm1(x) * l0 / (EA * g) + np.minimum(off, 0.0)
        sizes = moved_sizes(moved)
        felt, unfelt = self.pulls.T @ off / self.unit, self.free.T @ (moved[:6] / MOVED[:6])
        return np.concatenate([felt, unfelt, moved[6:] / sizes[6:]])

    def moved(self, vector: Array, y: Array) -> Array:
        """The first state of coordinates; NaN where none is found."""
        r = self.pulls.shape[1]
        moved = np.concatenate([self.near[:6], y[6:] * moved_sizes(y)[6:]])
        goal = y[:r] * self.unit
        if self._stiffens(vector):  # the inverse of what `of` does
            EA, g, l0 = self._law(vector)
            off = self.pulls @ goal
            x = np.log1p(g * EA * np.maximum(off, 0.0) / l0)
            goal = self.pulls.T @ (x * l0 / (EA * g) + np.minimum(off, 0.0))
        try:
            for _ in range(STEPS):
                off, J = self._stretches(vector, moved)
                unfelt = y[r:6] - self.free.T @ (moved[:6] / MOVED[:6])
                lacking = np.concatenate([goal - self.pulls.T @ off, unfelt])
                slopes = np.vstack([self.pulls.T @ J, self.free.T / MOVED[:6]])
                step = np.linalg.solve(slopes, lacking)
                moved[:6] += step
                if np.max(np.abs(step)) < SETTLED:
                    break
        except (CableGeometryError, np.linalg.LinAlgError):
            return np.full(len(y), np.nan)
        return moved

    def _stretches(self, vector: Array, moved: Array) -> tuple[Array, Array]:
        """How far cables are stretched at a first state, times stiffness over the believed one,
        shape (m,) [m], and its derivatives by rotation vector and translation, (m, 6)."""
        share = self.model.stiffer(vector)
        paths = cable_paths(_pose(self.model, moved), self.model.robot.cables)
        J = np.hstack([paths.J[:, :3] @ _turning(moved[:3]), paths.J[:, 3:]])
        return share * (paths.lengths - self.model.lengths(vector)), share * J

    def _stiffens(self, vector: Array) -> bool:
        """True if cables stiffen, and the pose feels each of them: then stretches that stay would
        have tensions of another exponential at each step, and the valley would bend again."""
        apart = self.pulls.shape[0] == self.pulls.shape[1]
        return apart and self.model.behaviour(vector).stiffening > 0.0

    def _law(self, vector: Array) -> tuple[Array, float, Array]:
        """Believed stiffnesses [N], stiffening [1/N], unstrained lengths [m]."""
        model = self.model
        g = model.behaviour(vector).stiffening
        return model.robot.cables.stiffness, g, model.lengths(vector)


def _turning(v: Array) -> Array:
    """Small turns in W by changes of a rotation vector, shape (3, 3)."""
    angle, S = float(np.linalg.norm(v)), cross_matrix(v)
    if angle < 1e-4:
        return np.asarray(np.eye(3) + 0.5 * S + S @ S / 6.0, float)
    first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * S + second * S @ S, float)


def _pose(model: SwingModel, moved: Array) -> RigidTransform:
    turn = RotationMatrix(Rotation.from_rotvec(moved[:3]).as_matrix())
    return RigidTransform(turn @ model.start.rotation(), model.start.translation() + moved[3:6])
