"""How large the gain of a tension correction may be: from stiffness, rate and delay.

A correction (5.1) winds a cable of stiffness k whose tension t is below its threshold h, every T
seconds, by what it measured tau ago: l0' = -g (h - t). With y = h - t, M the tension that all
cables gain per length wound in, and the positive part of each number,

    y(j + 1) = y(j) - T M G max(y(j - d), 0),      G = diag(g),  d = tau / T.

Held fast by others, a platform lets cables know nothing of each other: M = diag(k). On its cables
it gives way: M = K_c - K_c J K^-1 J' K_c with K_c = diag(k) and the platform's stiffness K. Where
that is the cables' own, K = J' K_c J, M is between 0 and K_c (a projection, scaled by K_c), of as
many dimensions as there are cables to spare. So what holds for diag(k) holds for all together.

**Whichever cables are below their thresholds, and whenever that changes,** max(y, 0) is a slope
between 0 and 1 in every cable. By the circle criterion, the loop settles where for all frequencies
Re[G_d(w)] lambda > -1, lambda the largest eigenvalue of sqrt(G) M sqrt(G), and
G_d = T e^(-i d w) / (e^(i w) - 1), of which the real part is -T sin((d + 1/2) w) / (2 sin(w / 2)),
at least -T (d + 1/2). Hence

    g k (T / 2 + tau) < 1,

for each cable, which `tension_gain` keeps with a margin. For a fixed set of cables the loop is
linear and its poles solve z^d (z - 1) + T mu = 0, mu an eigenvalue of M_SS G_SS: it is stable for
T mu < 2 sin(pi / (4 d + 2)), `linear_limit`: 2 without a delay, as the bound above; 1 with a delay
of one period, where that says 2/3. With few cables below their thresholds mu is a part of g k
only, and larger gains do, until one cable more goes slack.

What is left out: the platform's own motion, which `SampledCorrection` has; winches that lag, which
count as delay; noise.

Source of the linear limit: S. A. Levin and R. M. May, A note on difference-delay equations,
Theoretical Population Biology 9, 1976.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from cdpr_drake.arrays import Array
from cdpr_drake.errors import ControlGainError

MARGIN = 1.5
"""How much stiffer than believed cables may be by default, or later the readings."""

SHARES = tuple(2.0**-k for k in range(6, -1, -1))
"""Shares of a gain that are tried, from 1/64 on."""

WHOLE = 1e-9
"""A delay this much above whole periods, or a pole above 1, is rounding."""

REAL = 1e-6
"""A pole whose imaginary part is this share of it is real: of double ones rounding makes pairs."""


def tension_gain(
    stiffness: Array | float, rate: float, delay: float = 0.0, *, margin: float = MARGIN
) -> Array:
    """Gain of a tension correction, 1 / (margin k (T / 2 + tau)), which any slack leaves stable.

    Args:
        stiffness: k of each cable, E S over its unstrained length, shape (m,), or one [N/m].
        rate: Corrections per second, 1 / T [Hz].
        delay: tau, from a tension to the velocity that it asks for, beside T [s].
        margin: At least 1, where stiffness and delay are as they are said to be.

    Returns:
        Velocity per missing tension, of the shape of `stiffness` [m/(N s)].

    Raises:
        ControlGainError: A number is not accepted; names it.
    """
    k = np.asarray(stiffness, float)
    for name, value, fits, accepted in (
        ("stiffness", k, np.all(np.isfinite(k) & (k > 0.0)), "above 0 [N/m]"),
        ("rate", rate, np.isfinite(rate) and rate > 0.0, "above 0 [Hz]"),
        ("delay", delay, np.isfinite(delay) and delay >= 0.0, "at least 0 [s]"),
        ("margin", margin, np.isfinite(margin) and margin >= 1.0, "at least 1"),
    ):
        if not fits:
            raise ControlGainError(
                f"{name} of a tension correction: found {np.min(value):g}; accepted: {accepted}"
            )
    return 1.0 / (margin * k * (0.5 / rate + delay))


def tension_response(stiffness: Array, J: Array, K: Array) -> Array:
    """Tension that cables gain per length wound in, the platform being at rest: M.

    Args:
        stiffness: k of each cable, shape (m,) [N/m].
        J: Length rates per twist, shape (m, n) [m/rad, -].
        K: Stiffness of the platform, shape (n, n).

    Returns:
        Shape (m, m) [N/m].
    """
    pull = np.asarray(stiffness)[:, np.newaxis] * J
    return np.asarray(np.diag(stiffness) - pull @ np.linalg.solve(K, pull.T))


def linear_limit(steps: int) -> float:
    """Largest T mu of a fixed set of cables whose tensions are that many whole periods late [-]."""
    return float(2.0 * np.sin(np.pi / (4.0 * steps + 2.0)))


def correction_poles(
    response: Array, gains: Array, rate: float, steps: int = 0
) -> NDArray[np.complex128]:
    """Poles of the sampled loop of cables that are all below their thresholds, platform at rest.

    Args:
        response: M of these cables, shape (m, m) [N/m].
        gains: Their gains, shape (m,) [m/(N s)].
        rate: Corrections per second [Hz].
        steps: Whole periods by which tensions are late.

    Returns:
        Shape (m (steps + 1),), complex; those at 1 are lengths that no tension tells of.
    """
    m = len(gains)
    A = np.eye(m * (steps + 1), k=-m)
    A[:m, :m] = np.eye(m)
    A[:m, steps * m :] -= response @ np.diag(gains) / rate
    return np.asarray(np.linalg.eigvals(A), complex)


@dataclass(frozen=True, eq=False)
class SampledCorrection:
    """A correction beside a servo on a platform that moves on its cables, about its rest.

    Between samples M x'' + D x' + K x = J' k (y + R y') - J' k R J x', x the platform's
    displacement (turn, translation), y what is paid out, y' held; tensions are
    t = k (J x - y) + k R (J x' - y'). At a sample y' = g t of the cables below their thresholds,
    t of tau ago, less lambda J x, which a servo makes of what it sees.

    Attributes:
        mass: M, shape (n, n).
        stiffness: K, shape (n, n).
        J: Shape (m, n).
        cable_stiffness: k, shape (m,) [N/m].
        retardation: R of each cable, shape (m,) [s].
        damping: D, of the platform beside its cables, shape (n, n).
    """

    mass: Array
    stiffness: Array
    J: Array
    cable_stiffness: Array
    retardation: Array
    damping: Array
    _flows: dict[float, Array] = field(default_factory=dict, init=False, repr=False)

    def step(self, gains: Array, rate: float, delay: float = 0.0, servo: float = 0.0) -> Array:
        """What takes the loop's state from sample to sample.

        Args:
            gains: Of each cable, 0 above its threshold, shape (m,) [m/(N s)].
            rate: Samples per second [Hz].
            delay: tau [s].
            servo: lambda [1/s].

        Returns:
            A square matrix, for x, x', y, y' of the period before, and the tensions that are on
            their way, the latest first.
        """
        m, n = self.J.shape
        k, kR = self.cable_stiffness, self.cable_stiffness * self.retardation
        steps, move = int(np.ceil(delay * rate - WHOLE)), 2 * n + m
        reads = np.hstack([k[:, np.newaxis] * self.J, kR[:, np.newaxis] * self.J, -np.diag(k)])
        size = move + m + steps * m
        t = np.eye(m, size, k=size - m)  # what arrives at the sample
        if steps == 0:
            t = np.zeros((m, size))
            t[:, :move], t[:, move:] = reads, -np.diag(kR)
        v = np.diag(gains) @ t
        v[:, :n] -= servo * self.J
        A = np.zeros((size, size))
        A[:move] = self._moved(1.0 / rate, v)
        A[move : move + m] = v
        if steps:
            A[move + m : move + 2 * m] = (
                reads @ self._moved(steps / rate - delay, v) - np.diag(kR) @ v
            )
            A[move + 2 * m :, move + m : -m] = np.eye((steps - 1) * m)
        return A

    def growth(self, gains: Array, rate: float, delay: float = 0.0, servo: float = 0.0) -> float:
        """Largest modulus of the poles of `step` that swing; above 1 it is not stable.

        Poles that are real and above 0 are left out: they creep, at a rate of g times what weight
        and tensions add to the stiffness, and are the servo's matter.
        """
        poles = np.linalg.eigvals(self.step(gains, rate, delay, servo))
        swings = (np.abs(poles.imag) > REAL * np.abs(poles)) | (poles.real < 0.0)
        return float(np.max(np.abs(poles[swings]), initial=0.0))

    def stable_share(self, gains: Array, rate: float, delay: float = 0.0) -> float | None:
        """Largest of `SHARES` of these gains that is stable, with all below it; None: none is.

        With every cable below its threshold, each alone, and each two. Undamped modes that are
        about as fast as the corrections may ask for gains far below those of `tension_gain`.
        """
        m, best = len(gains), None
        chosen = [np.ones(m), *np.eye(m)]
        chosen += [np.isin(np.arange(m), pair) for pair in combinations(range(m), 2)]
        for share in SHARES:
            if any(
                self.growth(share * gains * which, rate, delay) > 1.0 + WHOLE for which in chosen
            ):
                break
            best = share
        return best

    def _moved(self, time: float, v: Array) -> Array:
        """(x, x', y) a time after a sample, of the state at it, with v the rows of y'."""
        if time not in self._flows:
            self._flows[time] = self._flow(time)
        moved, move = self._flows[time], 2 * self.J.shape[1] + self.J.shape[0]
        whole = moved[:move, move:] @ v
        whole[:, :move] += moved[:move, :move]
        return np.asarray(whole)

    def _flow(self, time: float) -> Array:
        """What takes (x, x', y, y') through a time in which y' is held."""
        m, n = self.J.shape
        k, kR, J = self.cable_stiffness, self.cable_stiffness * self.retardation, self.J
        A = np.zeros((2 * n + 2 * m,) * 2)
        A[:n, n : 2 * n] = np.eye(n)
        rows = np.hstack(
            [-self.stiffness, -self.damping - J.T @ (kR[:, np.newaxis] * J), J.T * k, J.T * kR]
        )
        A[n : 2 * n] = np.linalg.solve(self.mass, rows)
        A[2 * n : 2 * n + m, 2 * n + m :] = np.eye(m)
        return np.asarray(scipy.linalg.expm(A * time))
