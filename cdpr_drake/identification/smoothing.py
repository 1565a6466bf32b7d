"""Zero-phase smoothing of logged signals, with derivatives and with the noise that is left.

Signals are fitted by splines of degree five with knots at equal times, 1 / (2 f) apart: what is
slower than the bandwidth f passes, without a phase; derivatives are those of the spline. The same
smoothing goes over all signals of a log, so that what it takes it takes from both sides of an
equation. Of white noise it leaves correlated noise, whose covariance follows from the fit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline
from scipy.linalg import cho_solve_banded, cholesky_banded

from cdpr_drake.arrays import Array
from cdpr_drake.errors import IdentificationError

DEGREE = 5

ROWS_PER_KNOT = 2.0
"""A bandwidth is accepted where a log has as many rows from knot to knot."""

OUTLIER = 6.0
"""Rows that are as many standard deviations off the spline are left out."""

MOST_ROUNDS = 5
"""Times that rows are left out and the rest is fitted again."""


@dataclass(frozen=True, eq=False)
class Smoother:
    """Splines over the times of a log.

    Attributes:
        time: Of the rows, shape (k,) [s].
        bandwidth: f [Hz].
        knots: Knots of the splines [s].
    """

    time: Array
    bandwidth: float
    knots: Array

    @staticmethod
    def over(time: Array, bandwidth: float) -> Smoother:
        """For rows at these times, shape (k,), growing [s].

        Raises:
            IdentificationError: The log is too short or too slow for the bandwidth, or has a gap.
        """
        if len(time) < 4 * DEGREE:
            raise IdentificationError(
                f"log: found {len(time)} rows; accepted: at least {4 * DEGREE}"
            )
        span, step = float(time[-1] - time[0]), float(np.median(np.diff(time)))
        most = 0.5 / (ROWS_PER_KNOT * step)
        if not 0.0 < bandwidth <= most:
            raise IdentificationError(
                f"bandwidth: found {bandwidth:g} Hz; accepted: above 0 to {most:.3g} Hz, for rows "
                f"every {step:.3g} s"
            )
        count = round(2.0 * bandwidth * span)
        if count < 2:
            raise IdentificationError(
                f"bandwidth: found {bandwidth:g} Hz for a log of {span:.3g} s; accepted: at least "
                f"{1.0 / span:.3g} Hz"
            )
        inner = np.linspace(time[0], time[-1], count + 1)
        rows, _ = np.histogram(time, inner)
        if np.any(rows == 0):
            k = int(np.argmin(rows))
            raise IdentificationError(
                f"log: found no rows from {inner[k]:.4g} to {inner[k + 1]:.4g} s; accepted: rows "
                f"at least every {inner[1] - inner[0]:.3g} s, or a smaller bandwidth"
            )
        return Smoother(
            time, bandwidth, np.concatenate([[inner[0]] * DEGREE, inner, [inner[-1]] * DEGREE])
        )

    def sample_times(self) -> Array:
        """Where the splines are read: in the middle between knots, shape (s,) [s]."""
        inner = self.knots[DEGREE:-DEGREE]
        return np.asarray(0.5 * (inner[1:] + inner[:-1]))

    def fit(self, values: Array, robust: bool = True) -> Smoothed:
        """Fits signals, shape (k, q); rows with NaN in any are left out.

        Raises:
            IdentificationError: What is left has gaps.
        """
        B = BSpline.design_matrix(self.time, self.knots, DEGREE)
        used = np.asarray(np.isfinite(values).all(axis=1), dtype=bool)
        if not used.any():
            raise IdentificationError("log: found a signal without a row; accepted: some rows")
        for _ in range(MOST_ROUNDS):
            kept = B[used]
            normal = (kept.T @ kept).todia()
            band = np.zeros((DEGREE + 1, B.shape[1]))
            for d in range(DEGREE + 1):
                diagonal = normal.diagonal(d)
                band[DEGREE - d, d:] = diagonal
            try:
                factor = cholesky_banded(band)
            except np.linalg.LinAlgError:
                raise IdentificationError(
                    "log: found a gap in what was measured; accepted: rows at least every "
                    f"{0.5 / self.bandwidth:.3g} s, or a smaller bandwidth"
                ) from None
            c = cho_solve_banded((factor, False), kept.T @ values[used])
            rest = np.where(used[:, None], values - B @ c, 0.0)
            freedom = max(int(used.sum()) - B.shape[1], 1)
            sigma = np.sqrt(np.sum(rest[used] ** 2, axis=0) / freedom)
            off = used & np.any(np.abs(rest) > OUTLIER * np.maximum(sigma, 1e-12), axis=1)
            if not robust or not off.any():
                break
            used = np.asarray(used & ~off)
        dropped = np.asarray(np.isfinite(values).all(axis=1) & ~used)
        return Smoothed(self, c, sigma, factor, dropped)


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Signals as splines.

    Attributes:
        smoother: What smoothed them.
        coefficients: Of the splines, shape (c, q).
        sigma: Standard deviations of the noise of single rows, shape (q,).
        factor: Of the normal equations, by bands.
        dropped: Rows that were left out as outliers, shape (k,).
    """

    smoother: Smoother
    coefficients: Array
    sigma: Array
    factor: Array
    dropped: npt.NDArray[np.bool_]

    def at(self, time: Array, derivative: int = 0) -> Array:
        """Signals or their derivatives at times, shape (s, q)."""
        spline = BSpline(self.smoother.knots, self.coefficients, DEGREE)
        return np.asarray(spline(time, nu=derivative))

    def noise(self, time: Array, *derivatives: int) -> Array:
        """Covariance that unit white noise of the rows leaves at times, in all derivatives at once.

        Args:
            time: Shape (s,) [s].
            derivatives: d of them; none: that of the signal itself.

        Returns:
            Shape (d s, d s), derivative by derivative.
        """
        knots, count = self.smoother.knots, len(self.coefficients)
        first, last = np.searchsorted(knots[DEGREE + 1 : count], [time.min(), time.max()], "right")
        felt = slice(first, last + DEGREE + 1)  # coefficients that move any of these times
        local = BSpline(
            knots[first : last + 2 * DEGREE + 2], np.eye(last - first + DEGREE + 1), DEGREE
        )
        B = np.vstack([local(time, nu=derivative) for derivative in derivatives or (0,)])
        whole = np.zeros((count, len(B)))
        whole[felt] = B.T
        return np.asarray(B @ cho_solve_banded((self.factor, False), whole)[felt])
