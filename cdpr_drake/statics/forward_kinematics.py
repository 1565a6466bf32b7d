"""Pose of the platform from its cables' lengths, near a guess: forward kinematics."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.errors import ForwardKinematicsError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_type import FREE, MotionType
from cdpr_drake.geometry.poses import pose_row, rotation_from_vector
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.statics.pose_fit_kernel import (
    BAD_INDEX,
    BAD_LENGTHS,
    FITS,
    MAX_STEPS,
    MISFIT,
    UNSETTLED,
    fit_matrix,
    fit_poses,
    lengths_at,
)

TOLERANCE = 1e-6
"""Largest residual of a pose that is said to have the lengths [m], unless another is asked for."""

SCATTER = 0.1
"""Share of the mean length by which a measured one may be off the best pose: more is no error of a
measurement but another robot, unit or order of the cables."""

TURNED = (0.25, 0.6)
"""Angles by which guesses are turned, where measured lengths are fitted [rad]."""

_project = RotationMatrix.ProjectToRotationMatrix


class PoseFit(NamedTuple):
    """A pose that has the given cable lengths, or fits them best.

    Attributes:
        X_WP: The pose.
        residuals: Lengths at the pose less those given, of the cables used, shape (k,) [m].
        steps: Linear systems that were solved.
        J: Length Jacobian of the cables used at the pose, shape (k, n), columns (rotation,
            translation), those that the platform has, see `MotionType.basis`.
        turns: How many of the columns are rotations.
    """

    X_WP: RigidTransform
    residuals: Array
    steps: int
    J: Array
    turns: int = 3

    def covariance(self, sigma: float) -> Array:
        """Covariance of the pose, shape (n, n) [rad, m], if each length errs by sigma [m].

        For independent errors of the lengths; of the rotation vector and translation in W.
        """
        return np.asarray(sigma**2 * np.linalg.inv(self.J.T @ self.J), float)

    def scatter(self) -> float | None:
        """Standard deviation of the lengths by their residuals [m]; None without redundant ones."""
        spare = len(self.residuals) - self.J.shape[1]
        return float(np.sqrt(self.residuals @ self.residuals / spare)) if spare > 0 else None

    def condition(self, length: float) -> float:
        """Condition number of J with rotations times a length [m], for example the anchors'."""
        scale = np.ones(self.J.shape[1])
        scale[: self.turns] = 1.0 / length
        return float(np.linalg.cond(self.J * scale))


@dataclass(frozen=True)
class PoseFits:
    """Poses for many sets of lengths.

    Attributes:
        poses: (quaternion wxyz, position), shape (k, 7) [-, m]; NaN where none was found.
        codes: Shape (k,): 1 found, 0 lengths fit no pose near the guess, -1 not settled, -2 the
            lengths do not determine the pose.
        steps: Linear systems that were solved, shape (k,).
    """

    poses: Array
    codes: np.ndarray
    steps: np.ndarray


class ForwardKinematics:
    """Finds the pose near a guess at which the cables have given lengths.

    Levenberg-Marquardt on SO(3) x R^3. What comes back has these lengths, within a tolerance, and
    is determined by them; everything else is a `ForwardKinematicsError`. Where the search from
    the guess ends at a wrong local minimum, which its residual tells, it starts again from guesses
    turned by 0.25 and 0.6 rad about each axis.

    With more cables than degrees of freedom, exact lengths single out one pose. With just as
    many (six of 3R3T, three in a plane) there are several poses that have exactly these lengths,
    up to 40: returned is the one that short steps from the guess lead to, almost always the
    nearest. The lengths cannot tell whether it is the true one; a closer guess can.

    Source: servoing thesis, section 2.2.3.
    """

    def __init__(self, cables: CableSet, motion: MotionType = FREE) -> None:
        """For cables over their pulleys; `CableSet.without_pulleys` leaves them out.

        The platform moves as its type says; of the guess, what it cannot move stays.

        Raises:
            ForwardKinematicsError: There are fewer cables than degrees of freedom.
        """
        self.cables = cables
        self._cables = cables.packed()
        self._motion, self._free = motion, motion.packed()
        self.num_unknowns = motion.freedom
        self._check_count(len(self._cables))
        self._all = np.arange(len(self._cables))
        self._size = (len(self._cables),)
        self._X = np.empty((3, 4))
        self._R, self._p = self._X[:, :3], self._X[:, 3]

    def lengths(self, X_WP: RigidTransform) -> Array:
        """Lengths of all cables at a pose, over the pulleys, shape (m,) [m]."""
        return self._at(np.concatenate([pose_row(X_WP), np.zeros(6)]))[0]

    def pose(
        self,
        lengths: Array,
        guess: RigidTransform,
        used: np.ndarray | None = None,
        tolerance: float = TOLERANCE,
    ) -> PoseFit:
        """The pose with these lengths.

        Args:
            lengths: Lengths of all cables, stretched if they are elastic, shape (m,) [m].
            guess: Pose to start from.
            used: Indices of the cables to use; None: all.
            tolerance: Largest accepted residual [m]; for measured lengths of more cables than
                degrees of freedom, what their errors explain.

        Raises:
            ForwardKinematicsError: The lengths fit no pose near the guess, says by how much; they
                do not determine one; or numbers make no sense.
        """
        given, used = lengths, self._all if used is None else self._one_row_used(used)
        lengths, k = np.ascontiguousarray(lengths, float), len(used)
        if lengths.shape != self._size:
            lengths = self._checked_lengths(given, self._size)
        residuals, J = np.empty(k), np.empty((k, 6))
        code, steps = fit_matrix(
            guess.GetAsMatrix4(), self._cables, used, lengths, self._free, tolerance, self._X,
            residuals, J,
        )  # fmt: skip
        if code != FITS:
            if code == BAD_LENGTHS:
                self._checked_lengths(given, self._size)
            if code == BAD_INDEX:
                self._checked_used(used, 1)
            raise ForwardKinematicsError(
                _why(code, guess.translation(), residuals, used, tolerance)
            )
        # A rotation but for rounding, which is removed sooner than the constructor checks it.
        X_WP = RigidTransform(_project(self._R), self._p)
        if not self._motion.is_free:
            J = self._motion.columns(J, X_WP.rotation().matrix())
        return PoseFit(X_WP, residuals, steps, J, self._motion.num_turns)

    def best_pose(self, lengths: Array, guess: RigidTransform) -> PoseFit:
        """The pose near a guess with the least sum of squared residuals, for measured lengths.

        As `pose` where the lengths fit one exactly. Else the best of the minima that the search
        from the guess and from guesses turned by `TURNED` about each axis end at.

        Args:
            lengths: Lengths of all cables, stretched if they are elastic, shape (m,) [m].
            guess: Pose to start from.

        Raises:
            ForwardKinematicsError: The best fit misses a length by more than `SCATTER` of the mean
                length, or there are no more cables than degrees of freedom and no pose has the
                lengths; the lengths do not determine a pose; or numbers make no sense.
        """
        try:
            return self.pose(lengths, guess)
        except ForwardKinematicsError as problem:
            if len(self._all) == self.num_unknowns:
                raise
            first = problem
        axes = np.eye(3) if self._motion.num_turns == 3 else np.array([self._motion.axis])
        turns = [np.zeros(3)]
        if self._motion.num_turns > 0:
            turns += [angle * axis for angle in TURNED for axis in np.vstack([axes, -axes])]
        fits = []
        for turn in turns:
            R = rotation_from_vector(turn) @ guess.rotation()
            with suppress(ForwardKinematicsError):
                start = RigidTransform(R, guess.translation())
                fits.append(self.pose(lengths, start, tolerance=np.inf))
        if not fits:
            raise first
        best = min(fits, key=lambda fit: float(fit.residuals @ fit.residuals))
        scatter = SCATTER * float(np.mean(lengths))
        if np.max(np.abs(best.residuals)) > scatter:
            p, every = best.X_WP.translation(), self._all
            raise ForwardKinematicsError(_why(MISFIT, p, best.residuals, every, scatter))
        return best

    def poses(
        self,
        lengths: Array,
        guesses: Array,
        used: np.ndarray | None = None,
        tolerance: float = TOLERANCE,
        threads: int | None = None,
    ) -> PoseFits:
        """Poses for many sets of lengths, on all cores; what is not found is NaN, with a code.

        Args:
            lengths: Shape (k, m) [m].
            guesses: (quaternion wxyz, position), shape (k, 7), see `pose_row`.
            used: Indices of the cables to use, shape (k, n_used); None: all.
            tolerance: Largest accepted residual [m].
            threads: Number of threads; None: all cores.

        Raises:
            ForwardKinematicsError: Sizes that do not fit, or numbers that make no sense.
        """
        guesses = np.ascontiguousarray(guesses, float)
        if guesses.ndim != 2 or guesses.shape[1] != 7:
            raise ForwardKinematicsError(
                f"guesses: found shape {guesses.shape}; accepted: (k, 7), quaternion and position"
            )
        count = len(guesses)
        lengths = self._checked_lengths(lengths, (count, *self._size))
        if used is None:
            used = np.tile(self._all, (count, 1))
        used = self._checked_used(used, 2)
        if len(used) != count:
            raise ForwardKinematicsError(f"used: found {len(used)} rows; accepted: {count}")
        poses, codes, steps = np.empty((count, 7)), np.empty(count, int), np.empty(count, int)
        over_rows(
            fit_poses, count, threads, guesses, self._cables, used, lengths, self._free,
            tolerance, poses, codes, steps,
        )  # fmt: skip
        poses[codes != FITS] = np.nan
        return PoseFits(poses, codes, steps)

    def _check_count(self, count: int) -> None:
        if count < self.num_unknowns:
            raise ForwardKinematicsError(
                f"cables: found {count}; accepted: at least {self.num_unknowns}, as many as "
                "degrees of freedom (with fewer, the pose follows from equilibrium)"
            )

    def _at(self, state: Array) -> tuple[Array, Array]:
        """All lengths and their Jacobian at a state, shape (13,)."""
        lengths, J = np.empty(len(self._all)), np.empty((len(self._all), 6))
        lengths_at(state, self._cables, lengths, J)
        return lengths, J

    def _one_row_used(self, used: np.ndarray) -> np.ndarray:
        """Indices of cables, but for what the kernel checks itself."""
        indices = np.ascontiguousarray(used, int)
        if indices.ndim != 1 or len(indices) < self.num_unknowns:
            return self._checked_used(used, 1)
        return indices

    def _checked_used(self, used: np.ndarray, axes: int) -> np.ndarray:
        used = np.ascontiguousarray(used, int)
        if used.ndim != axes:
            raise ForwardKinematicsError(f"used: found {used.ndim} axes; accepted: {axes}")
        self._check_count(used.shape[-1])
        m = len(self._all)
        if np.any(used < 0) or np.any(used >= m):
            raise ForwardKinematicsError(
                f"used: found index {used.min() if used.min() < 0 else used.max()}; "
                f"accepted: indices 0 to {m - 1}"
            )
        return used

    def _checked_lengths(self, lengths: Array, shape: tuple[int, ...]) -> Array:
        lengths = np.ascontiguousarray(lengths, float)
        if lengths.shape != shape:
            words = " x ".join(str(size) for size in shape)
            raise ForwardKinematicsError(f"lengths: found shape {lengths.shape}; accepted: {words}")
        if not (np.all(np.isfinite(lengths)) and np.all(lengths > 0.0)):
            raise ForwardKinematicsError("lengths: found NaN or one <= 0; accepted: > 0 [m]")
        return lengths


def tautest_cables(tensions: Array, count: int) -> np.ndarray:
    """Indices of the cables of largest tension, in the cables' order, shape (count,).

    Of equal tensions the first cables count as tauter. Source: servoing thesis, algorithm 2.
    """
    return np.sort(np.argsort(-np.asarray(tensions, float), kind="stable")[:count])


def _why(code: int, p: Array, residuals: Array, used: np.ndarray, tolerance: float) -> str:
    point = ", ".join(f"{x:.4g}" for x in p)
    worst = int(np.argmax(np.abs(residuals)))
    misses = f"misses cable {used[worst] + 1} by {1e3 * abs(residuals[worst]):.4g} mm"
    if code == UNSETTLED:
        return (
            f"lengths: the search from the guess at ({point}) m did not settle in {MAX_STEPS} "
            f"steps; its last pose {misses}"
        )
    if code == MISFIT:
        return (
            f"lengths: no pose near ({point}) m has them; the best fit {misses}; "
            f"accepted: up to {1e3 * tolerance:.4g} mm"
        )
    return (
        f"lengths: they do not determine the pose near ({point}) m; a motion there changes none of "
        f"the lengths of cables {', '.join(str(i + 1) for i in used)}"
    )
