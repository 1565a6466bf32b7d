"""What was measured as linear equations in the unknown vector, weighted by its noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_triangular

from cdpr_drake.arrays import Array
from cdpr_drake.identification.parameters import (
    COMPLIANCE,
    COULOMB,
    EXCESS,
    LAG,
    OFFSET,
    PER_CABLE,
    VISCOUS,
    column,
)
from cdpr_drake.identification.regressor import (
    INERTIA,
    MASS,
    MOMENT,
    SIZE,
    inertia_regressor,
    symmetric,
)
from cdpr_drake.identification.samples import MotionSamples, WinchSamples
from cdpr_drake.spatial import cross_matrix

TINY = 1e-12
"""Added to variances that are compared with the largest, so that none is singular to rounding."""


SURELY = 2.0
"""A velocity or acceleration is more than noise where it is so many times as large."""

LEAST_TORQUE = 1e-9
"""Noise of torques of a log that has none [N m]."""


class Rows(NamedTuple):
    """A theta = b with noise of unit variance: A of shape (r, n), b of shape (r,)."""

    A: Array
    b: Array


class Term(Protocol):
    """A kind of measurement."""

    @property
    def name(self) -> str:
        """What it is called."""

    def rows(self, theta: Array) -> Rows:
        """Weighted equations, linear at a vector, shape (n,)."""

    def misfit(self, theta: Array) -> dict[str, float]:
        """Root mean square of what is not explained, by quantity with its unit."""


@dataclass(frozen=True, eq=False)
class MotionTerm:
    """Newton and Euler: the wrench of the cables is what the motion asks for."""

    samples: MotionSamples
    gravity: Array
    Y: Array
    noise: tuple[tuple[Array, Array], ...]
    name: str = "platform wrench"

    @staticmethod
    def make(samples: MotionSamples, gravity: Array) -> MotionTerm:
        """With the regressor and the noise that smoothing leaves, of rows and of accelerations."""
        X, t = samples.smoothed
        Y = inertia_regressor(samples.R_WP, samples.V_WP, samples.A_WP, gravity)
        noise = tuple(
            (t.noise(samples.time[b]), X.noise(samples.time[b], 2)) for b in samples.blocks()
        )
        return MotionTerm(samples, np.asarray(gravity, float), Y, noise)

    def rows(self, theta: Array) -> Rows:
        """See `Term`; accelerations are as noisy as the second derivative of smoothed poses."""
        s, n = self.samples, len(theta)
        A, b = np.zeros((6 * s.count, n)), np.empty(6 * s.count)
        wrench = s.wrench
        spread = np.array([s.sigma_turn] * 3 + [s.sigma_place] * 3)
        for block, (white, second) in zip(s.blocks(), self.noise, strict=True):
            pulled = s.W[block] * s.sigma_tensions
            moved = _mass_matrices(s.R_WP[block], theta[:SIZE]) * spread
            K = _correlated(white, pulled) + _correlated(second, moved)
            own = slice(6 * block.start, 6 * block.stop)
            A[own, :SIZE] = _whitened(K, self.Y[block].reshape(-1, SIZE))
            b[own] = _whitened(K, wrench[block].ravel())
        return Rows(A, b)

    def told(self) -> MotionTerm:
        """The same with velocities and accelerations that may be noise alone taken for none.

        Noise in a regressor looks like excitation, and tells nothing.
        """
        s, (X, _) = self.samples, self.samples.smoothed
        spread = np.array([s.sigma_turn] * 3 + [s.sigma_place] * 3)
        V, A = s.V_WP.copy(), s.A_WP.copy()
        for derivative, table in ((1, V), (2, A)):
            variances = [np.diag(X.noise(s.time[b], derivative)) for b in s.blocks()]
            noise = np.mean(np.concatenate(variances)) * spread**2
            table[:, np.mean(table**2, axis=0) < SURELY**2 * noise] = 0.0
        Y = inertia_regressor(s.R_WP, V, A, self.gravity)
        return replace(self, Y=Y)

    def predicted(self, theta: Array) -> Array:
        """Wrenches that the motion asks for, shape (s, 6) [N m, N]."""
        return np.asarray(self.Y @ theta[:SIZE])

    def misfit(self, theta: Array) -> dict[str, float]:
        """See `Term`: forces and moments."""
        off = self.samples.wrench - self.predicted(theta)
        return {
            "force_n": float(np.sqrt(np.mean(off[:, 3:] ** 2))),
            "moment_nm": float(np.sqrt(np.mean(off[:, :3] ** 2))),
        }


@dataclass(frozen=True, eq=False)
class CableTerm:
    """Kelvin and Voigt: a cable is longer than its winch counts by what its tension makes it.

    l - l0 = offset + l0 y / EA with y + T dy/dt = t, of which y = t - T dt/dt + T^2 d2t/dt2.

    Source: servoing thesis (2.6).
    """

    samples: MotionSamples
    counted: Array
    sigma_lengths: float
    slack_below: float
    noise: tuple[Array, ...]
    name: str = "cable lengths"

    @staticmethod
    def make(
        samples: MotionSamples, counted: Array, sigma_lengths: float, slack_below: float
    ) -> CableTerm:
        """With unstrained lengths that winches count at the samples, shape (s, m) [m]."""
        X, _ = samples.smoothed
        noise = tuple(X.noise(samples.time[b]) for b in samples.blocks())
        return CableTerm(samples, counted, sigma_lengths, slack_below, noise)

    def _equations(self, theta: Array) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
        """Unweighted A, shape (s, m, 3) by compliance, lag, offset, b (s, m), and who is taut."""
        s, l0 = self.samples, self.counted
        cables = theta[SIZE:].reshape(-1, PER_CABLE)
        T = cables[:, LAG] / cables[:, COMPLIANCE]
        first, second = s.tension_rates
        A = np.stack([l0 * (s.tensions + T**2 * second), -l0 * first, np.ones_like(l0)], axis=2)
        return A, s.lengths - l0, np.asarray(s.tensions > self.slack_below)

    def rows(self, theta: Array) -> Rows:
        """See `Term`; lengths are as noisy as the poses and as what winches count."""
        s, m = self.samples, self.counted.shape[1]
        A, b, taut = self._equations(theta)
        spread = np.array([s.sigma_turn] * 3 + [s.sigma_place] * 3)
        parts = []
        places = [[column(i, what) for what in (COMPLIANCE, LAG, OFFSET)] for i in range(m)]
        for block, white in zip(s.blocks(), self.noise, strict=True):
            J = np.swapaxes(s.W[block], 1, 2) * spread
            # What tension sensors miss looks like strain.
            strain = theta[SIZE + COMPLIANCE :: PER_CABLE] * self.counted[block] * s.sigma_tensions
            own = np.hypot(self.sigma_lengths, strain)[:, :, None] * np.eye(m)
            K = _correlated(white, np.concatenate([J, own], axis=2))
            wide = np.zeros((len(J), m, len(theta)))
            for i in range(m):
                wide[:, i, places[i]] = A[block, i]
            keep = taut[block].ravel()
            if keep.any():
                K = K[np.ix_(keep, keep)]
                both = np.column_stack([wide.reshape(-1, len(theta)), b[block].ravel()])[keep]
                both = _whitened(K, both)
                parts.append(both)
        table = np.vstack(parts) if parts else np.zeros((0, len(theta) + 1))
        return Rows(table[:, :-1], table[:, -1])

    def misfit(self, theta: Array) -> dict[str, float]:
        """See `Term`: lengths of taut cables."""
        A, b, taut = self._equations(theta)
        cables = theta[SIZE:].reshape(-1, PER_CABLE)[:, [COMPLIANCE, LAG, OFFSET]]
        off = (b - np.einsum("smk,mk->sm", A, cables))[taut]
        return {"length_m": float(np.sqrt(np.mean(off**2))) if len(off) else 0.0}


@dataclass(frozen=True, eq=False)
class WinchTerm:
    """Friction of turning winches: Coulomb, Stribeck and viscous.

    Noise of each winch is what a least squares fit of its own rows leaves.

    Source: servoing thesis (5.7) with the sign of the speed.
    """

    samples: WinchSamples
    weights: Array
    name: str = "winch friction"

    @staticmethod
    def make(samples: WinchSamples, count: int) -> WinchTerm:
        """For so many winches."""
        x = _friction_columns(samples)
        root, weights = np.sqrt(samples.rows), np.zeros(len(samples.time))
        for i in range(count):
            mine = samples.cable == i
            if not mine.any():
                continue
            A, b = x[mine] * root[mine, None], samples.friction[mine] * root[mine]
            fit, _, rank, _ = np.linalg.lstsq(A, b, rcond=None)
            degrees = max(int(mine.sum()) - int(rank), 1)
            sigma = float(np.sqrt(np.sum((A @ fit - b) ** 2) / degrees))
            weights[mine] = root[mine] / max(sigma, LEAST_TORQUE)
        return WinchTerm(samples, weights)

    def _equations(self, size: int) -> Array:
        s = self.samples
        A, rows = np.zeros((len(s.time), size)), np.arange(len(s.time))
        columns = _friction_columns(s)
        for k, what in enumerate((COULOMB, EXCESS, VISCOUS)):
            A[rows, SIZE + PER_CABLE * s.cable + what] = columns[:, k]
        return A

    def rows(self, theta: Array) -> Rows:
        """See `Term`."""
        A = self._equations(len(theta))
        return Rows(A * self.weights[:, None], self.samples.friction * self.weights)

    def misfit(self, theta: Array) -> dict[str, float]:
        """See `Term`: torques."""
        off = self.samples.friction - self._equations(len(theta)) @ theta
        return {"friction_nm": float(np.sqrt(np.mean(off**2)))}


def _friction_columns(samples: WinchSamples) -> Array:
    """Torques of unit Coulomb friction, unit excess of static friction, unit viscous friction."""
    sign = np.sign(samples.speed)
    return np.column_stack([sign, sign * samples.excess, samples.speed])


def _mass_matrices(R: Array, pi: Array) -> Array:
    """Spatial inertia about Po in W, shape (s, 6, 6)."""
    h = cross_matrix(pi[MOMENT])
    M = np.zeros((6, 6))
    M[:3, :3], M[:3, 3:], M[3:, :3] = symmetric(pi[INERTIA]), h, -h
    M[3:, 3:] = pi[MASS] * np.eye(3)
    turn = np.zeros((len(R), 6, 6))
    turn[:, :3, :3] = turn[:, 3:, 3:] = R
    return np.asarray(turn @ M @ np.swapaxes(turn, 1, 2))


def _correlated(C: Array, G: Array) -> Array:
    """Covariance of G_a n_a with cov(n_a, n_b) = C_ab 1: from (s, s) and (s, r, q), (s r, s r)."""
    s, r, _ = G.shape
    K = np.einsum("ab,aiq,bjq->aibj", C, G, G, optimize=True)
    return np.asarray(K.reshape(s * r, s * r))


def _whitened(K: Array, x: Array) -> Array:
    """L^-1 x with K = L L'."""
    L = np.linalg.cholesky(K + TINY * np.max(np.diag(K)) * np.eye(len(K)))
    return np.asarray(solve_triangular(L, x, lower=True))
