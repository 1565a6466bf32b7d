"""Input shaping: impulses that make a command leave no vibration behind.

A command is convolved with impulses of amplitudes A_i >= 0 at times t_i, sum A_i = 1. Of what a
vibration of frequency w and damping ratio zeta would do after one impulse, they leave the share

    V = exp(-zeta w t_n) sqrt(C^2 + S^2),
    C = sum A_i exp(zeta w t_i) cos(w_d t_i),   S = sum A_i exp(zeta w t_i) sin(w_d t_i),

with w_d = w sqrt(1 - zeta^2). ZV makes it zero, ZVD its derivative by w as well, EI leaves a chosen
share at w and none on either side, so that it stays below that over a wider range.

Source: Singer and Seering, Preshaping command inputs to reduce system vibration, 1990; Singhose,
Seering, Singer, Residual vibration reduction using vector diagrams to generate shaped inputs, 1994.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError, accepted_names

INSENSITIVE = 0.05
"""Share of vibration that EI leaves at its frequency."""

LARGEST_DAMPING = 0.9
"""Of modes that are shaped; those damped more die out by themselves."""

SHAPERS = ("ZV", "ZVD", "EI")


@dataclass(frozen=True, eq=False)
class Shaper:
    """Impulses.

    Attributes:
        times: When they come, the first at 0, growing, shape (k,) [s].
        amplitudes: Positive, of sum 1, shape (k,).
    """

    times: Array
    amplitudes: Array

    @property
    def duration(self) -> float:
        """By how much it prolongs a command [s]."""
        return float(self.times[-1])

    def then(self, other: Shaper) -> Shaper:
        """Both, one after the other; what either takes away is gone."""
        times = np.add.outer(self.times, other.times).ravel()
        amplitudes = np.multiply.outer(self.amplitudes, other.amplitudes).ravel()
        order = np.argsort(times, kind="stable")
        return Shaper(times[order], amplitudes[order])

    def left(self, frequency: float, damping: float = 0.0) -> float:
        """Share V of a vibration that is left.

        Args:
            frequency: w, undamped [rad/s].
            damping: zeta, from 0 to below 1.
        """
        damped = frequency * np.sqrt(1.0 - damping**2)
        grown = self.amplitudes * np.exp(damping * frequency * (self.times - self.times[-1]))
        return float(
            np.hypot(grown @ np.cos(damped * self.times), grown @ np.sin(damped * self.times))
        )


NO_SHAPER = Shaper(np.zeros(1), np.ones(1))
"""It leaves a command as it is."""


def make_shaper(kind: str, frequency: float, damping: float = 0.0) -> Shaper:
    """A shaper for one vibration.

    Args:
        kind: One of `SHAPERS`. The times of EI are those of ZVD, and its amplitudes those of a
            vibration without damping, spread by the damping as those of ZVD are.
        frequency: w, undamped, above 0 [rad/s].
        damping: zeta, from 0 to `LARGEST_DAMPING`.

    Raises:
        PlanningError: The kind is unknown or a number is not accepted.
    """
    if kind not in SHAPERS:
        raise PlanningError(f"shaper: found {kind!r}; {accepted_names(kind, SHAPERS)}")
    if not (np.isfinite(frequency) and frequency > 0.0):
        raise PlanningError(f"shaper: frequency: found {frequency:g} rad/s; accepted: above 0")
    if not 0.0 <= damping <= LARGEST_DAMPING:
        raise PlanningError(f"shaper: damping: found {damping:g}; accepted: 0 to {LARGEST_DAMPING}")
    root = np.sqrt(1.0 - damping**2)
    half = np.pi / (frequency * root)
    K = np.exp(-damping * np.pi / root)
    if kind == "ZV":
        times, weights = np.array([0.0, half]), np.array([1.0, K])
    else:
        V = INSENSITIVE if kind == "EI" else 0.0
        times = np.array([0.0, half, 2.0 * half])
        weights = np.array([1.0 + V, 2.0 * (1.0 - V) * K, (1.0 + V) * K**2])
    return Shaper(times, weights / np.sum(weights))


def shaped_share(shaper: Shaper, duration: float, times: Array) -> tuple[Array, Array, Array]:
    """A quintic law of time from 0 to 1, shaped: s, ds/dt, d2s/dt2 at times, shape (n,) each.

    Args:
        shaper: The shaper.
        duration: Of the law that is shaped, above 0 [s].
        times: Shape (n,) [s].
    """
    x = np.clip((np.asarray(times)[:, np.newaxis] - shaper.times) / duration, 0.0, 1.0)
    s = x**3 * (10.0 + x * (-15.0 + 6.0 * x))
    first = 30.0 * x**2 * (1.0 - x) ** 2 / duration
    second = 60.0 * x * (1.0 + x * (-3.0 + 2.0 * x)) / duration**2
    A = shaper.amplitudes
    return s @ A, first @ A, second @ A
