"""Residuals at a minimum behind the projector off all that parameters and poses can follow.

Formulas are those of `fit_groups`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh
from scipy.optimize import nnls

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.elimination import MOST_POSES, UNTOLD, LeastSquares
from cdpr_drake.calibration.pose_search import OUTLIER
from cdpr_drake.calibration.result import used_rows
from cdpr_drake.calibration.stations import POSE, Point

LEAST_SEEN = 1e-6
"""Share of an error that residuals show; of less, poses and parameters follow it."""

LEAST_COMPONENT = 0.1
"""A variance component is no smaller than this share of the kind's own mean square over its degrees
of freedom, which holds where readings of few degrees leave components undecided."""

LEAST_DEGREES = 0.5
"""Degrees of freedom from which on a kind tells its own scatter; below, that of all is taken."""

END_ROWS = 3
"""Rows on each side of an instant at which a log is split, at least."""

TRUNCATED = 1.1
"""By how much the scatter is larger than that of the readings that remain, where noise is twice its
sigma."""

Rows = npt.NDArray[np.intp]
Flags = npt.NDArray[np.bool_]


class ProjectedResiduals:
    """Residuals at a minimum, and the projector M that is behind them.

    All arrays are over sigma and in typical sizes; rows of all terms stand beside each other.

    Attributes:
        r: Residuals, shape (k, R); zero where none counts.
        whole: Those of readings that were thrown out as well.
        expected: What the fit expects, shape (k, R); zero where a factor means nothing. Measured
            values would not do: the noise in them fits itself with a factor of 0.
        slopes: Derivatives by poses of all that was measured, shape (k, R, q).
        measured, used, lost: Readings by what became of them, each shape (k, R).
        names, units, sigma: Of columns; sigma has shape (k, R).
        kinds, columns, scatter: Of each kind its name, columns, and s_g.
        noise: Scatter with that of the readings that were thrown out, shape (g,); at least 1.
        gross: Readings that were thrown out and are no such noise, shape (k, R).
        degrees, degrees_of: Degrees of freedom, trace of M; and of each kind.
        told: Whether a kind tells its own scatter, shape (g,).
    """

    def __init__(self, problem: LeastSquares, at: Point, pose_std: Array) -> None:
        self.problem, self.at, self.pose_std = problem, at, pose_std
        terms = problem.terms
        self.measured = np.concatenate([term.measured() for term in terms], axis=1)
        self.used = np.concatenate([used_rows(problem, k) for k in range(len(terms))], axis=1)
        self.lost = self.measured & ~self.used
        widths = [term.measured().shape[1] for term in terms]
        ends = np.cumsum(widths)
        self.kinds = [term.kind for term in terms]
        self.columns = [
            np.arange(end - width, end) for end, width in zip(ends, widths, strict=True)
        ]
        self.members = np.array([np.isin(np.arange(ends[-1]), own) for own in self.columns], float)
        every = [(term, c) for term, width in zip(terms, widths, strict=True) for c in range(width)]
        self.names = [term.row_name(c, at.model.names) for term, c in every]
        self.units = [term.row_unit(c) for term, c in every]
        self.sigma = np.concatenate([term.sigmas() for term in terms], axis=1)
        blocks = replace(problem, dropped=None).blocks(at)
        parts = [part.evaluate(there) for part, there in blocks]
        self.whole, A, self.slopes = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        values = np.nan_to_num(np.concatenate([term.values(at) for term in terms], axis=1))
        valued = self.measured & np.any(values != 0.0, axis=0)
        self.expected = np.where(valued, values / self.sigma + self.whole, 0.0)
        self.r = np.where(self.used, self.whole, 0.0)
        A, B = (np.where(self.used[:, :, None], x, 0.0) for x in (A, self.slopes))
        self._A, self._B = A, B
        H = np.swapaxes(B, 1, 2) @ B
        self._Bt = np.linalg.solve(H, np.swapaxes(B, 1, 2))  # (k, q, R)
        self.A = A - B @ (self._Bt @ A)
        typical = at.layout.typical[problem.free]
        self._prior = problem.prior.evaluate(at, problem.free)[1] * typical
        flat = self.A.reshape(self.r.size, A.shape[2])
        self._inverse = _inverse_of(flat.T @ flat + self._prior.T @ self._prior)
        self._components()
        self.noise = np.maximum(1.0, TRUNCATED * self.scatter)
        self.gross = self.lost & (np.abs(self.whole) > OUTLIER * (self.noise @ self.members))

    def _components(self) -> None:
        """Degrees of freedom and scatter of each kind, by variance components."""
        count, V = len(self.members), self._inverse
        own = np.where(self.used, 1.0, 0.0)
        traces, both = [], []
        for begin in range(0, len(own), MOST_POSES):
            some = slice(begin, begin + MOST_POSES)
            rest = np.eye(own.shape[1]) * own[some][:, :, None] - self._B[some] @ self._Bt[some]
            hat = self.A[some] @ V @ np.swapaxes(self.A[some], 1, 2)
            traces.append(np.einsum("krr->r", rest - hat))
            both.append(np.sum(rest**2 - 2.0 * rest * hat, axis=0))
        self.degrees_of = self.members @ sum(traces[1:], traces[0])
        self.degrees = float(self.degrees_of.sum())
        S = [
            np.einsum("krf,krh->fh", self.A * own, self.A) for own in self.members[:, None, :, None]
        ]
        squares = self.members @ sum(both[1:], both[0]) @ self.members.T
        P = self._prior.T @ self._prior
        squares += [[np.sum((V @ S[a]) * (V @ S[b]).T) for b in range(count)] for a in range(count)]
        known = np.array([np.sum((V @ S[a]) * (V @ P).T) for a in range(count)])
        self.sums = self.members @ np.sum(self.r**2, axis=0)
        found, _ = nnls(squares, np.maximum(self.sums - known, 0.0))
        self.told = self.degrees_of > LEAST_DEGREES
        plain = self.sums / np.where(self.told, self.degrees_of, np.inf)
        pooled = self.sums.sum() / max(self.degrees, LEAST_DEGREES)
        squares_of = np.where(self.told, np.maximum(found, LEAST_COMPONENT * plain), pooled)
        self.scatter = np.sqrt(squares_of + 1e-30)

    def likely_instant(self, error: Array) -> Rows:
        """Rows from an instant on in which an error explains most of the residuals."""
        rest = error - np.einsum("krq,kq->kr", self._B, np.einsum("kqr,kr->kq", self._Bt, error))
        follows = np.einsum("krf,kr->kf", self.A, error)
        sums = [np.sum(x, axis=1) for x in (error * rest, self.r * error, error**2)]
        size, along, whole, a = (np.cumsum(x[::-1], axis=0)[::-1] for x in (*sums, follows))
        size = size - np.einsum("kf,kf->k", a @ self._inverse, a)
        told = size > LEAST_SEEN * whole
        told[:END_ROWS] = told[max(len(told) - END_ROWS + 1, 0) :] = False
        first = int(np.argmax(np.where(told, along**2 / np.where(told, size, 1.0), 0.0)))
        return np.arange(first or len(told), len(told))

    def projected(self, D: Array) -> tuple[Array, Array]:
        """M D of directions, shape (k, R, n), and its prior rows, shape (p, n)."""
        D = D - self._B @ (self._Bt @ D)
        along = self._inverse @ np.einsum("krf,krn->fn", self.A, D)
        return D - self.A @ along, -self._prior @ along

    def moves(self, error: Array) -> float:
        """By how many stated deviations poses move by an error, root mean square.

        Args:
            error: Of residuals over sigma, shape (k, R).
        """
        eliminated = error - np.einsum("krq,kqs,ks->kr", self._B, self._Bt, error)
        theta = self._inverse @ np.einsum("krf,kr->f", self.A, eliminated)
        rest = error - self._A @ theta
        steps = (self._Bt @ rest[:, :, None])[:, :, 0] * self.problem.station_scale(self.at)
        stations = self.at.stations
        wide = self.problem.freedom.widen(steps, stations.R, stations.width)
        sizes = np.column_stack(
            [np.linalg.norm(wide[:, :3], axis=1), np.linalg.norm(wide[:, 3:POSE], axis=1)]
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            ratios = np.where(self.pose_std > 0.0, sizes / self.pose_std, 0.0)
        return float(np.max(np.sqrt(np.mean(ratios**2, axis=0))))


def _inverse_of(S: Array) -> Array:
    """Inverse of an information in what it tells, as `symmetric_solve` has it."""
    if not len(S):
        return S
    values, V = eigh(0.5 * (S + S.T))
    told = values > UNTOLD**2
    return np.asarray((V[:, told] / values[told]) @ V[:, told].T)
