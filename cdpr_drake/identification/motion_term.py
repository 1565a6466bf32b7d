"""Newton and Euler as equations, weighted by noise of tensions and of poses in all they enter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from cdpr_drake.arrays import Array
from cdpr_drake.identification.correlated_noise import CorrelatedNoise, correlated, once_a_vector
from cdpr_drake.identification.regressor import SIZE, inertia_regressor, regressor_slopes
from cdpr_drake.identification.result import Residual
from cdpr_drake.identification.samples import LoggedMotion
from cdpr_drake.identification.terms import Rows, largest_residuals

SURELY = 2.0
"""A velocity or acceleration is more than noise where it is so many times as large."""

ROUNDS = 12
"""Times that poses and tensions are corrected at most, each from the last correction."""

SETTLED = 1e-3
"""Corrections end where weighted residuals change by less [sigma], over the largest where that is
more than one."""

BOUNDED, BOUNDED_SQUARE = 1.5, 0.7784
"""Residuals count as no more than so many sigmas where the error of poses is estimated, and the
mean square that normal ones then have: as usual for proposal 2, which bears a third of outliers."""

LEAST_OFF, MOST_OFF, OFF_WITHIN = 1e-7, 1.0, 0.05
"""Errors of poses that are looked for [m], and how exactly, as a share of them."""

EQUATIONS = (
    ("moment about x", "N m"), ("moment about y", "N m"), ("moment about z", "N m"),
    ("force along x", "N"), ("force along y", "N"), ("force along z", "N"),
)  # fmt: skip


class _Corrected(NamedTuple):
    """Equations at corrected poses and tensions.

    Attributes:
        W: Wrench matrices, shape (s, 6, m).
        Y: Regressors, shape (s, 6, 10).
        G: What noise of poses makes of rows, by unit noise, shape (s, 6, 3, 6).
        rest: Residuals to first order at what was measured, shape (s, 6).
    """

    W: Array
    Y: Array
    G: Array
    rest: Array


@dataclass(frozen=True, eq=False)
class MotionTerm:
    """The wrench of the cables is what the motion asks for: W(x) t = Y(x, x', x'') pi.

    Tensions t and poses x are as noisy as smoothing leaves them. Both sides depend on the pose, so
    its noise n reaches a row through d(W t - Y pi)/dx, dx' and dx'', which have one covariance, as
    they belong to the same splines:

        covariance of rows = W S_t W' + G S_x G',   G = d(W t)/dx - d(Y pi)/d(x, x', x'').

    With fewer than six cables W S_t W' alone is singular: across the cables' wrenches a row is as
    good as the poses are. Since Y is noisy too, least squares with these weights would find too
    little mass, and where poses are worse than they seem, next to none: equations in which no
    tension is are met by a body without mass. So the most likely true poses and tensions are
    found along with the body, and equations stand at those.

    S_x is what poses jitter about their splines. An error that smoothing passes, of geometry, of a
    tracker's frame, of a slow filter, is not in it, and weights that call such poses exact rest the
    estimate on that error. So poses are also off by `off` in each coordinate, and by `off` over
    `size` about each axis, independently at each sample, which adds G_0 D^2 G_0' with the part G_0
    of G that goes with the poses themselves. `off` is the variance component with which residuals
    are as large as weights say, each of them bounded (Huber's proposal 2): poses that are lost for
    a while do not pass for an error of all.

    Source: Fuller, Measurement error models, 1987, chapter 3; Boggs, Byrd, Schnabel, A stable and
    efficient algorithm for nonlinear orthogonal distance regression, 1987; Paule, Mandel, Consensus
    values and weighting factors, 1982; Huber, Robust estimation of a location parameter, 1964.
    """

    samples: LoggedMotion
    gravity: Array
    Y: Array
    slopes: Array
    noise: tuple[tuple[Array, Array], ...]
    size: float
    off: float = 0.0
    rounds: int = ROUNDS
    name: str = "platform wrench"

    @staticmethod
    def make(samples: LoggedMotion, gravity: Array, size: float) -> MotionTerm:
        """With the regressor, its derivatives, and the noise that smoothing leaves.

        Args:
            samples: The motion.
            gravity: Acceleration of a falling body in W, shape (3,) [m/s^2].
            size: Of the platform: so far from Po a turn moves what it is attached to [m].
        """
        s, (X, t) = samples, samples.smoothed
        g = np.asarray(gravity, float)
        Y = inertia_regressor(s.R_WP, s.V_WP, s.A_WP, g)
        slopes = regressor_slopes(s.R_WP, s.V_WP, s.A_WP, g) * s.pose_spread
        noise = tuple((t.noise(s.time[b]), X.noise(s.time[b], 0, 1, 2)) for b in s.blocks())
        return MotionTerm(samples, g, Y, slopes, noise, size)

    def rows(self, theta: Array) -> Rows:
        """See `Term`."""
        at, noises = self._settled(theta[:SIZE])
        s, A, b = self.samples, np.zeros((6 * self.samples.count, len(theta))), []
        for block, noise in zip(s.blocks(), noises, strict=True):
            Y = at.Y[block].reshape(-1, SIZE)
            right = at.rest[block].ravel() + Y @ theta[:SIZE]
            both = noise.whitened(np.column_stack([Y, right]))
            A[6 * block.start : 6 * block.stop, :SIZE] = both[:, :-1]
            b.append(both[:, -1])
        return Rows(A, np.concatenate(b))

    def with_errors_of_poses(self, theta: Array, bounded: bool) -> MotionTerm:
        """The same with the error of poses that explains what a vector, shape (n,), leaves;
        `bounded`: residuals count as no more than `BOUNDED` sigmas."""
        most, usual = (BOUNDED, BOUNDED_SQUARE) if bounded else (np.inf, 1.0)

        def excess(log_off: float) -> float:
            A, b = replace(self, off=float(np.exp(log_off))).rows(theta)
            return float(np.log(np.mean(np.minimum(np.abs(A @ theta - b), most) ** 2) / usual))

        low, high = np.log([LEAST_OFF, MOST_OFF])
        if excess(low) <= 0.0:
            return replace(self, off=0.0)
        if excess(high) >= 0.0:
            return replace(self, off=MOST_OFF)
        return replace(self, off=float(np.exp(brentq(excess, low, high, xtol=OFF_WITHIN))))

    def told(self) -> MotionTerm:
        """The same with velocities and accelerations that may be noise alone taken for none.

        Noise in a regressor looks like excitation, and tells nothing.
        """
        s = self.samples
        V, A = s.V_WP.copy(), s.A_WP.copy()
        for derivative, table in ((1, V), (2, A)):
            variances = [np.diag(C_x).reshape(3, -1)[derivative] for _, C_x in self.noise]
            noise = np.mean(np.concatenate(variances)) * s.pose_spread**2
            table[:, np.mean(table**2, axis=0) < SURELY**2 * noise] = 0.0
        Y = inertia_regressor(s.R_WP, V, A, self.gravity)
        return replace(self, Y=Y, rounds=0)

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

    def largest(self, theta: Array) -> list[Residual]:
        """See `Term`."""
        at, noises = self._settled(theta[:SIZE])
        s = self.samples
        each = zip(s.blocks(), noises, strict=True)
        off = [noise.over_others(at.rest[block].ravel()) for block, noise in each]
        value = s.wrench - self.predicted(theta)
        time, which = np.repeat(s.time, 6), np.tile(np.arange(6), s.count)
        return largest_residuals(time, which, value.ravel(), np.concatenate(off), EQUATIONS)

    @property
    def _offs(self) -> Array:
        """Errors of poses over what they jitter, shape (6,)."""
        return self.off * np.array([1.0 / self.size] * 3 + [1.0] * 3) / self.samples.pose_spread

    @once_a_vector
    def _settled(self, pi: Array) -> tuple[_Corrected, list[CorrelatedNoise]]:
        """Equations at the most likely poses and tensions for a body, and their noise."""
        s = self.samples
        poses, pulls = np.zeros((s.count, 3, 6)), np.zeros_like(s.tensions)
        last = None
        for left in range(self.rounds, -1, -1):
            at = self._corrected(pi, poses, pulls)
            noises = [
                CorrelatedNoise.of(self._covariance(at, n, b)) for n, b in enumerate(s.blocks())
            ]
            if left == 0:
                break
            rests = [at.rest[b].ravel() for b in s.blocks()]
            now = np.concatenate(
                [noise.whitened(rest) for noise, rest in zip(noises, rests, strict=True)]
            )
            if last is not None:
                size = max(1.0, float(np.max(np.abs(now))))
                if np.max(np.abs(now - last)) < SETTLED * size:
                    break
            last = now
            for n, b in enumerate(s.blocks()):
                v = noises[n].over_covariance(rests[n]).reshape(-1, 6)
                C_t, C_x = self.noise[n]
                pulls[b] = C_t @ np.einsum("aim,ai->am", at.W[b], v) * s.sigma_tensions**2
                felt = np.einsum("aioq,ai->oaq", at.G[b], v).reshape(-1, 6)
                poses[b] = np.swapaxes((C_x @ felt).reshape(3, -1, 6), 0, 1)
                poses[b, 0] += self._offs**2 * felt.reshape(3, -1, 6)[0]
        return at, noises

    def _corrected(self, pi: Array, poses: Array, pulls: Array) -> _Corrected:
        """Equations where the noise is believed to be this, in sigmas and in newtons."""
        s = self.samples
        moved = s.W_slopes * s.pose_spread
        W = s.W - np.einsum("aimq,aq->aim", moved, poses[:, 0])
        t = s.tensions - pulls
        Y = self.Y - np.einsum("aikoq,aoq->aik", self.slopes, poses)
        G = -np.einsum("aikoq,k->aioq", self.slopes, pi)
        G[:, :, 0] += np.einsum("aimq,am->aiq", moved, t)
        rest = np.einsum("aim,am->ai", W, s.tensions) - Y @ pi
        return _Corrected(W, Y, G, rest + np.einsum("aioq,aoq->ai", G, poses))

    def _covariance(self, at: _Corrected, number: int, block: slice) -> Array:
        """Of the rows of a block, shape (6 s, 6 s)."""
        C_t, C_x = self.noise[number]
        G, count = at.G[block], block.stop - block.start
        K = correlated(C_t, at.W[block] * self.samples.sigma_tensions)
        K += correlated(np.eye(count), G[:, :, 0] * self._offs)
        by_row = np.swapaxes(C_x.reshape(3, count, 3 * count), 0, 1)
        half = np.swapaxes(G, 2, 3).reshape(count, 36, 3) @ by_row
        half = half.reshape(count, 6, 6, 3, count).transpose(4, 0, 1, 3, 2)
        whole = half.reshape(count, 6 * count, 18) @ np.swapaxes(G.reshape(count, 6, 18), 1, 2)
        return np.asarray(K + whole.transpose(1, 0, 2).reshape(6 * count, 6 * count))
