"""What was measured, and what is known beforehand, as linear equations in the unknown vector.

A `Term` is a kind of measurement: rows A theta = b, weighted by its noise. `prior_rows` makes
equations in the same vector of what is known of parameters beforehand.

Source: servoing thesis (2.6), (5.7) with the sign of the speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from cdpr_drake.arrays import Array
from cdpr_drake.identification.correlated_noise import CorrelatedNoise, correlated, once_a_vector
from cdpr_drake.identification.parameters import (
    CENTER,
    COMPLIANCE,
    COULOMB,
    DAMPING,
    EXCESS,
    FRICTION,
    LAG,
    MASS_GROUP,
    MOMENTS,
    OFFSET,
    PER_CABLE,
    STIFFNESS,
    VISCOUS,
    DynamicModel,
    column,
)
from cdpr_drake.identification.regressor import MASS, SIZE
from cdpr_drake.identification.result import Residual
from cdpr_drake.identification.samples import LoggedMotion, WinchSamples

MOST_SHOWN = 5
"""Residuals of a kind of measurement that are named."""

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

    def largest(self, theta: Array) -> list[Residual]:
        """The largest residuals, largest first, at most one of an instant."""


@dataclass(frozen=True, eq=False)
class CableTerm:
    """Kelvin and Voigt: a cable is longer than its winch counts by what its tension makes it.

    l - l0 = offset + l0 y / EA with y + T dy/dt = t, of which y = t - T dt/dt + T^2 d2t/dt2.

    Source: servoing thesis (2.6).
    """

    samples: LoggedMotion
    counted: Array
    sigma_lengths: float
    slack_below: float
    cables: tuple[str, ...]
    noise: tuple[Array, ...]
    name: str = "cable lengths"

    @staticmethod
    def make(
        samples: LoggedMotion, counted: Array, sigma_lengths: float, slack_below: float,
        cables: tuple[str, ...],
    ) -> CableTerm:  # fmt: skip
        """With unstrained lengths that winches count at the samples, shape (s, m) [m]."""
        X, _ = samples.smoothed
        noise = tuple(X.noise(samples.time[b]) for b in samples.blocks())
        return CableTerm(samples, counted, sigma_lengths, slack_below, cables, noise)

    def _equations(self, theta: Array) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
        """Unweighted A, shape (s, m, 3) by compliance, lag, offset, b (s, m), and who is taut."""
        s, l0 = self.samples, self.counted
        cables = theta[SIZE:].reshape(-1, PER_CABLE)
        T = cables[:, LAG] / cables[:, COMPLIANCE]
        first, second = s.tension_rates
        A = np.stack([l0 * (s.tensions + T**2 * second), -l0 * first, np.ones_like(l0)], axis=2)
        return A, s.lengths - l0, np.asarray(s.tensions > self.slack_below)

    def _rest(self, theta: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
        """Lengths that are not explained, shape (s, m) [m], and who is taut."""
        A, b, taut = self._equations(theta)
        cables = theta[SIZE:].reshape(-1, PER_CABLE)[:, [COMPLIANCE, LAG, OFFSET]]
        return b - np.einsum("smk,mk->sm", A, cables), taut

    @once_a_vector
    def _noises(self, theta: Array) -> list[CorrelatedNoise]:
        """Of the lengths of taut cables in each block: of poses, of what winches count, of
        tensions, which look like strain."""
        s, m = self.samples, self.counted.shape[1]
        found = []
        for block, white in zip(s.blocks(), self.noise, strict=True):
            J = np.swapaxes(s.W[block], 1, 2) * s.pose_spread
            strain = theta[SIZE + COMPLIANCE :: PER_CABLE] * self.counted[block] * s.sigma_tensions
            own = np.hypot(self.sigma_lengths, strain)[:, :, None] * np.eye(m)
            keep = np.flatnonzero(s.tensions[block] > self.slack_below)
            K = correlated(white, np.concatenate([J, own], axis=2))
            found.append(CorrelatedNoise.of(K[np.ix_(keep, keep)]))
        return found

    def rows(self, theta: Array) -> Rows:
        """See `Term`."""
        m = self.counted.shape[1]
        A, b, taut = self._equations(theta)
        parts = [np.zeros((0, len(theta) + 1))]
        places = [[column(i, what) for what in (COMPLIANCE, LAG, OFFSET)] for i in range(m)]
        for block, noise in zip(self.samples.blocks(), self._noises(theta), strict=True):
            wide = np.zeros((block.stop - block.start, m, len(theta)))
            for i in range(m):
                wide[:, i, places[i]] = A[block, i]
            keep = taut[block].ravel()
            both = np.column_stack([wide.reshape(-1, len(theta)), b[block].ravel()])[keep]
            if keep.any():
                parts.append(noise.whitened(both))
        table = np.vstack(parts)
        return Rows(table[:, :-1], table[:, -1])

    def largest(self, theta: Array) -> list[Residual]:
        """See `Term`."""
        value, taut = self._rest(theta)
        sigmas = np.zeros_like(value)
        for block, noise in zip(self.samples.blocks(), self._noises(theta), strict=True):
            keep = taut[block]
            if keep.any():
                sigmas[block][keep] = noise.over_others(value[block][keep])
        time, which = np.nonzero(taut)
        equations = [(f"length of {name}", "m") for name in self.cables]
        return largest_residuals(
            self.samples.time[time], which, value[taut], sigmas[taut], equations
        )

    def misfit(self, theta: Array) -> dict[str, float]:
        """See `Term`: lengths of taut cables."""
        value, taut = self._rest(theta)
        off = value[taut]
        return {"length_m": float(np.sqrt(np.mean(off**2))) if len(off) else 0.0}


@dataclass(frozen=True, eq=False)
class WinchTerm:
    """Friction of turning winches: Coulomb, Stribeck and viscous.

    Noise of each winch is what a least squares fit of its own rows leaves.

    Source: servoing thesis (5.7) with the sign of the speed.
    """

    samples: WinchSamples
    weights: Array
    cables: tuple[str, ...]
    name: str = "winch friction"

    @staticmethod
    def make(samples: WinchSamples, cables: tuple[str, ...]) -> WinchTerm:
        """For the winches of these cables."""
        x = _friction_columns(samples)
        root, weights = np.sqrt(samples.rows), np.zeros(len(samples.time))
        for i in range(len(cables)):
            mine = samples.cable == i
            if not mine.any():
                continue
            A, b = x[mine] * root[mine, None], samples.friction[mine] * root[mine]
            fit, _, rank, _ = np.linalg.lstsq(A, b, rcond=None)
            degrees = max(int(mine.sum()) - int(rank), 1)
            sigma = float(np.sqrt(np.sum((A @ fit - b) ** 2) / degrees))
            weights[mine] = root[mine] / max(sigma, LEAST_TORQUE)
        return WinchTerm(samples, weights, cables)

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

    def largest(self, theta: Array) -> list[Residual]:
        """See `Term`."""
        s = self.samples
        off = s.friction - self._equations(len(theta)) @ theta
        equations = [(f"torque of the winch of {name}", "N m") for name in self.cables]
        return largest_residuals(s.time, s.cable, off, off * self.weights, equations)


def largest_residuals(
    time: Array,
    which: npt.NDArray[np.intp],
    value: Array,
    sigmas: Array,
    equations: Sequence[tuple[str, str]],
) -> list[Residual]:
    """The `MOST_SHOWN` largest, the largest of each instant, by sigmas.

    Args:
        time: Of each, shape (r,) [s].
        which: Equation of each, shape (r,).
        value: What is not explained, shape (r,).
        sigmas: The same in standard deviations, shape (r,).
        equations: Words and unit of each equation.
    """
    found: dict[float, Residual] = {}
    for k in np.argsort(-np.abs(sigmas)):
        words, unit = equations[int(which[k])]
        one = Residual(float(time[k]), words, float(value[k]), unit, float(abs(sigmas[k])))
        found.setdefault(one.time, one)
        if len(found) == MOST_SHOWN:
            break
    return list(found.values())


def _friction_columns(samples: WinchSamples) -> Array:
    """Torques of unit Coulomb friction, unit excess of static friction, unit viscous friction."""
    sign = np.sign(samples.speed)
    return np.column_stack([sign, sign * samples.excess, samples.speed])


Prior = tuple[dict[int, float], float, float]
"""Factors by place in the vector, what they make of it, and its standard deviation."""


def prior_rows(model: DynamicModel, group: str, std: float) -> list[Prior]:
    """A group of parameters known as a model has them, see `IdentificationProgram.AddPrior`."""
    believed, cables = model.vector(), range(len(model.names))
    if group == MASS_GROUP:
        return [({MASS: 1.0}, believed[MASS], std)]
    if group == CENTER:
        center = model.center_of_mass / model.mass
        return [({1 + j: 1.0 / model.mass, MASS: -float(center[j])}, 0.0, std) for j in range(3)]
    if group == MOMENTS:
        return [({k: 1.0}, believed[k], std) for k in range(4, SIZE)]
    if group == STIFFNESS:
        places = [(column(i, COMPLIANCE), float(model.stiffness[i])) for i in cables]
        return [({k: 1.0}, believed[k], std / EA**2) for k, EA in places]
    if group == DAMPING:
        pairs = [(i, float(model.stiffness[i]), float(model.retardation[i])) for i in cables]
        return [
            ({column(i, LAG): EA, column(i, COMPLIANCE): -T * EA}, 0.0, std) for i, EA, T in pairs
        ]
    what = (COULOMB, VISCOUS) if group == FRICTION else (EXCESS,)
    return [
        ({k: 1.0}, believed[k], std) for k in (column(i, each) for i in cables for each in what)
    ]
