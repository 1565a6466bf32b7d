"""Two recordings of one motion by two clocks: by how much one is late, how fast it goes, how sure.

One recorder has samples y(t), the other x(t'), of quantities that are smooth functions of each
other, such as cable lengths and a tracker's position; nothing of that function need be known. With
t = t' + shift + drift (t' - reference), y is fitted by polynomials of x at each shift and drift, so
that these two alone stay unknown.

Source: Golub, Pereyra, The differentiation of pseudo-inverses and nonlinear least squares problems
whose variables separate, SIAM J. Numer. Anal. 10 (1973); standard deviations of correlated
residuals: Liang, Zeger, Longitudinal data analysis using generalized linear models, Biometrika 73
(1986), with stretches of the motion as clusters.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import find_peaks

from cdpr_drake.arrays import Array
from cdpr_drake.errors import ClockError

LEAST_ROWS = 50
"""Rows that both recorders must share."""

GAP = 2.5
"""So many usual steps apart, nothing is interpolated between two samples."""

LEAST_OVERLAP = 0.5
"""Share of the shorter recording in which both must have run."""

CANDIDATES = 6
"""Shifts at which the speeds of both go together that are tried."""

ALIKE = 1.2
"""Two shifts whose residuals differ by less than this factor cannot be told apart."""

EXPLAINED = 0.2
"""Residuals above this share of what moves mean that both did not record one motion."""

ROUNDS = 30
"""Steps of Gauss and Newton, at most; six do, once the shift is right to a tenth of a second."""

STILL = 1e-7, 1e-9
"""Steps of shift [s] and drift [-] that end them, far below what noise lets one know."""

ROUGHLY = 400
"""Rows that tell which of several shifts to go on from."""

STRETCHES = 40
"""Stretches of the motion whose residuals are taken as independent of each other."""

MOST_DRIFT = 0.05
"""Clocks that differ by more are none."""


@dataclass(frozen=True, eq=False)
class ClockAlignment:
    """How the other clock is read as the first one.

    Attributes:
        shift: What is added to the other clock at the reference [s].
        drift: By how much the first clock runs faster than the other [-].
        reference: Instant of the other clock at which the shift holds [s].
        covariance: Of shift and drift, shape (2, 2).
        residual: What is left of each of the first one's columns, rms, in its unit, shape (n,).
        rows: Rows of the first one that both recorded.
    """

    shift: float
    drift: float
    reference: float
    covariance: Array
    residual: Array
    rows: int

    @property
    def sigmas(self) -> tuple[float, float]:
        """Standard deviations of shift [s] and drift [-]."""
        shift, drift = np.sqrt(np.diag(self.covariance))
        return float(shift), float(drift)

    def on_first_clock(self, time: Array) -> Array:
        """Instants of the other clock as the first one tells them [s]."""
        t = np.asarray(time, float)
        return np.asarray(t + self.shift + self.drift * (t - self.reference))

    def on_other_clock(self, time: Array) -> Array:
        """Instants of the first clock as the other one tells them [s]."""
        t = np.asarray(time, float)
        return np.asarray((t - self.shift + self.drift * self.reference) / (1.0 + self.drift))


def align_clocks(
    time: Array, values: Array, other_time: Array, other_values: Array, degree: int = 3
) -> ClockAlignment:
    """Reads the other clock as the first one.

    Args:
        time: Of the first recorder, growing, shape (k,) [s].
        values: Shape (k, n), NaN where nothing was measured.
        other_time: Of the other one, growing, shape (k',) [s].
        other_values: Shape (k', n').
        degree: Of the polynomials by which the first values are fitted by the other ones.

    Raises:
        ClockError: They share too little, did not record one motion, or several shifts do alike.
    """
    y, x = _finite_rows(time, values, "first"), _finite_rows(other_time, other_values, "second")
    fit = _Fit(*y, *x, degree)
    found = [made for start in fit.starts(_candidate_shifts(*y, *x)) if (made := fit.at(start))]
    if not found:
        raise ClockError(
            "clocks: found no shift at which both recordings go together; accepted: two of one "
            f"motion, which share {LEAST_OVERLAP:.0%} of the shorter one"
        )
    found.sort(key=lambda fit: fit.share)
    best = found[0]
    if best.share > EXPLAINED:
        raise ClockError(
            f"clocks: found {best.share:.0%} of the motion unexplained at the best shift, "
            f"{best.alignment.shift:.3f} s; accepted: below {EXPLAINED:.0%}, two recordings of "
            "one motion"
        )
    apart = 3.0 * float(np.median(np.diff(y[0])))
    for other in found[1:]:
        away = abs(other.alignment.shift - best.alignment.shift) > apart
        if away and other.share < ALIKE * best.share:
            raise ClockError(
                f"clocks: found shifts {best.alignment.shift:.3f} and {other.alignment.shift:.3f} "
                f"s that explain the motion alike ({best.share:.2%}, {other.share:.2%} left); "
                "accepted: a motion that does not repeat itself"
            )
    return best.alignment


def interpolate_rows(time: Array, values: Array, at: Array) -> Array:
    """Values at other instants, linear between samples, NaN in gaps and outside, shape (q, n).

    Args:
        time: Growing, shape (k,).
        values: Shape (k, n); a NaN makes a gap of its column.
        at: Shape (q,).
    """
    table = np.full((len(at), values.shape[1]), np.nan)
    widest = GAP * float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    for j, column in enumerate(values.T):
        kept = np.isfinite(column)
        if np.count_nonzero(kept) < 2:
            continue
        t, v = time[kept], column[kept]
        inside = _inside(t, at, widest)
        table[inside, j] = np.interp(at[inside], t, v)
    return table


def _inside(time: Array, at: Array, widest: float) -> np.ndarray:
    """Whether instants lie between two samples that are near enough, shape (q,)."""
    right = np.clip(np.searchsorted(time, at), 1, len(time) - 1)
    near = time[right] - time[right - 1] <= widest
    return np.asarray((at >= time[0]) & (at <= time[-1]) & near)


def _finite_rows(time: Array, values: Array, which: str) -> tuple[Array, Array]:
    rows = np.isfinite(values).all(axis=1) & np.isfinite(time)
    t, v = np.asarray(time, float)[rows], np.asarray(values, float)[rows]
    if len(t) < LEAST_ROWS:
        raise ClockError(
            f"clocks: found {len(t)} whole rows in the {which} recording; accepted: at least "
            f"{LEAST_ROWS}"
        )
    if np.any(np.diff(t) <= 0.0):
        raise ClockError(f"clocks: found times in the {which} recording that do not grow")
    if not np.any(np.ptp(v, axis=0) > 0.0):
        raise ClockError(f"clocks: found nothing that moves in the {which} recording")
    return t, v


def _candidate_shifts(time: Array, y: Array, other_time: Array, x: Array) -> list[float]:
    """Shifts at which the speeds of both correlate best, the best first [s]."""
    step = max(float(np.median(np.diff(time))), float(np.median(np.diff(other_time))))
    here, there = _speed(time, y, step), _speed(other_time, x, step)
    size = 1 << (len(here) + len(there)).bit_length()

    def over_lags(a: Array, b: Array) -> Array:
        """Sums of a[i + lag] b[i] for lag 1 - len(there) to len(here) - 1."""
        found = np.fft.irfft(np.fft.rfft(a, size) * np.conj(np.fft.rfft(b, size)), size)
        return np.concatenate([found[size - len(there) + 1 :], found[: len(here)]])

    one, other = np.ones(len(here)), np.ones(len(there))
    count = np.round(over_lags(one, other))
    enough = count >= LEAST_OVERLAP * min(len(here), len(there))
    with np.errstate(invalid="ignore", divide="ignore"):
        mean, mean_there = over_lags(here, other) / count, over_lags(one, there) / count
        spread = over_lags(here**2, other) / count - mean**2
        spread_there = over_lags(one, there**2) / count - mean_there**2
        both = over_lags(here, there) / count - mean * mean_there
        score = np.where(enough, both / np.sqrt(np.maximum(spread * spread_there, 1e-300)), -1.0)
    lags = np.arange(1 - len(there), len(here))
    peaks = find_peaks(np.concatenate([[-2.0], score, [-2.0]]))[0] - 1
    best = peaks[np.argsort(-score[peaks])][:CANDIDATES]
    return [float(time[0] - other_time[0] + lags[k] * step) for k in best]


def _speed(time: Array, values: Array, step: float) -> Array:
    """Speed in space of all columns, on even instants, shape (q,)."""
    grid = np.arange(time[0], time[-1], step)
    even = np.column_stack([np.interp(grid, time, column) for column in values.T])
    return np.asarray(np.linalg.norm(np.gradient(even, axis=0), axis=1))


@dataclass(frozen=True, eq=False)
class _Found:
    """A fit, and what share of the motion it leaves."""

    alignment: ClockAlignment
    share: float


class _Fit:
    """The fit of shift and drift, from a shift on."""

    def __init__(self, time: Array, y: Array, other_time: Array, x: Array, degree: int) -> None:
        middle, size = np.mean(x, axis=0), float(np.max(np.std(x, axis=0)))
        self.time, self.y, self.degree = time, y, degree
        self.other_time = other_time
        self.spline = CubicSpline(other_time, (x - middle) / size)
        self.reference = 0.5 * float(other_time[0] + other_time[-1])
        self.widest = GAP * float(np.median(np.diff(other_time)))
        self.most = 3.0 * float(np.median(np.diff(time)))
        self.spread = float(np.sqrt(np.mean(np.var(y, axis=0))))

    def starts(self, shifts: list[float]) -> list[float]:
        """The two best of shifts, each after a search round it."""
        scanned = [best for shift in shifts if (best := self._scanned(shift)) is not None]
        kept: list[float] = []
        for _, shift in sorted(scanned):
            if all(abs(shift - other) > self.most for other in kept):
                kept.append(shift)
        return kept[:2]

    def at(self, shift: float) -> _Found | None:
        """The best fit near a shift; None where both share too little, or it runs away."""
        p = np.array([shift, 0.0])
        for _ in range(ROUNDS):
            made = self._linear(p)
            if made is None:
                return None
            J, r, _, _ = made
            H = np.einsum("knp,knq->pq", J, J)
            scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
            step = (
                np.linalg.lstsq(
                    H / np.outer(scale, scale), -np.einsum("knp,kn->p", J, r) / scale, rcond=1e-12
                )[0]
                / scale
            )
            step *= min(1.0, 20.0 * self.most / max(abs(step[0]), 1e-300))
            p = p + step
            if abs(p[1]) > MOST_DRIFT:
                return None
            if abs(step[0]) < STILL[0] and abs(step[1]) < STILL[1]:
                break
        made = self._linear(p)
        return None if made is None else self._told(p, *made)

    def _scanned(self, shift: float) -> tuple[float, float] | None:
        """What is left at the best of shifts round a first one, and that; speeds tell it roughly.

        None where both share too little.
        """
        best: tuple[float, float] | None = None
        for away in np.arange(-12, 13) * self.most / 3.0:
            made = self._linear(np.array([shift + away, 0.0]), roughly=True)
            if made is not None:
                found = float(np.mean((made[2] / self.spread) ** 2)), float(shift + away)
                best = found if best is None else min(best, found)
        return best

    def _linear(
        self, p: Array, roughly: bool = False
    ) -> tuple[Array, Array, Array, np.ndarray] | None:
        """Slopes and residuals over their rms, that rms, and the rows; None: too few rows.

        Args:
            p: Shift and drift.
            roughly: By some of the rows, and without slopes.

        Returns:
            J, shape (k, n, 2); r, shape (k, n); rms by column, shape (n,); rows, shape (k,).
        """
        t_other = (self.time - p[0] + p[1] * self.reference) / (1.0 + p[1])
        rows = np.flatnonzero(_inside(self.other_time, t_other, self.widest))
        span = min(np.ptp(self.time), np.ptp(self.other_time)) * LEAST_OVERLAP
        if len(rows) < LEAST_ROWS or np.ptp(self.time[rows]) < span:
            return None
        if roughly:
            rows = rows[:: max(1, len(rows) // ROUGHLY)]
        at = t_other[rows]
        x, x_dot = self.spline(at), self.spline(at, 1)
        phi, phi_dot = _polynomials(x, x_dot, self.degree)
        y = self.y[rows]
        u, s, vt = np.linalg.svd(phi, full_matrices=False)
        kept = s > 1e-9 * s[0]
        u, s, vt = u[:, kept], s[kept], vt[kept]
        theta = vt.T @ ((u.T @ y) / s[:, None])
        r = u @ (u.T @ y) - y
        rms = np.sqrt(np.sum(r**2, axis=0) / max(len(rows) - len(s), 1))
        rms = np.maximum(rms, 1e-12 * max(float(np.max(np.abs(y))), 1e-300))
        r = r / rms
        if roughly:
            return np.empty((len(rows), 0, 2)), r, rms, rows
        moved = phi_dot @ theta / rms  # by the other clock
        by_shift = -moved / (1.0 + p[1])
        by_drift = by_shift * (at - self.reference)[:, None]
        J = np.stack([by_shift - u @ (u.T @ by_shift), by_drift - u @ (u.T @ by_drift)], axis=2)
        return J, r, rms, rows

    def _told(self, p: Array, J: Array, r: Array, rms: Array, rows: np.ndarray) -> _Found | None:
        H = np.einsum("knp,knq->pq", J, J)
        scale = np.sqrt(np.diag(H))
        if not np.all(scale > 0.0):
            return None
        inverse = np.linalg.inv(H / np.outer(scale, scale)) / np.outer(scale, scale)
        scores = np.einsum("knp,kn->kp", J, r)
        of_stretch = np.array([part.sum(axis=0) for part in np.array_split(scores, STRETCHES)])
        middle = of_stretch.T @ of_stretch * STRETCHES / (STRETCHES - 1)
        share = float(np.sqrt(np.sum(rms**2) / np.sum(np.var(self.y[rows], axis=0))))
        alignment = ClockAlignment(
            float(p[0]), float(p[1]), self.reference, inverse @ middle @ inverse, rms, len(rows)
        )
        return _Found(alignment, share)


def _polynomials(x: Array, x_dot: Array, degree: int) -> tuple[Array, Array]:
    """All products of at most `degree` columns, and their rates, shape (k, features)."""
    features, rates = [np.ones(len(x))], [np.zeros(len(x))]
    for size in range(1, degree + 1):
        for columns in combinations_with_replacement(range(x.shape[1]), size):
            parts = x[:, columns]
            features.append(np.prod(parts, axis=1))
            rate = np.zeros(len(x))
            for k in range(size):
                others = [j for j in range(size) if j != k]
                rate += np.prod(parts[:, others], axis=1) * x_dot[:, columns[k]]
            rates.append(rate)
    return np.column_stack(features), np.column_stack(rates)
