"""Noise that is correlated among the equations of a block: factors of its covariance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import TypeVar

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import IdentificationError
from cdpr_drake.identification.covariance_factor_kernel import factor, unwhiten, whiten

Owner = TypeVar("Owner")
Made = TypeVar("Made")


@dataclass(frozen=True, eq=False)
class CorrelatedNoise:
    """A covariance K = U' U of some equations, factored once.

    Attributes:
        U: Upper triangular, shape (n, n).
    """

    U: Array

    @staticmethod
    def of(K: Array) -> CorrelatedNoise:
        """Of a covariance, shape (n, n).

        Raises:
            IdentificationError: Some combination of the equations has no noise.
        """
        U = np.zeros(K.shape)
        if not factor(np.ascontiguousarray(K), U):
            raise IdentificationError(
                "noise: found equations without any, which cannot be weighted; accepted: a log "
                "whose poses, tensions and lengths are measured, with their noise"
            )
        return CorrelatedNoise(U)

    def whitened(self, x: Array) -> Array:
        """U'^-1 x: equations with noise of unit variance, shape (n,) or (n, k)."""
        return self._solved(whiten, x)

    def over_covariance(self, x: Array) -> Array:
        """K^-1 x, shape (n,) or (n, k)."""
        return self._solved(unwhiten, self.whitened(x))

    def over_others(self, rest: Array) -> Array:
        """By how many standard deviations residuals, shape (n,), are off where others are known.

        Each is normal of unit variance, and none is small because noise of other equations hides
        it: (K^-1 r)_i / sqrt((K^-1)_ii).

        Source: Cook, Weisberg, Residuals and influence in regression, 1982.
        """
        back = self.whitened(np.eye(len(rest)))
        return np.asarray(self.over_covariance(rest) / np.linalg.norm(back, axis=0))

    def _solved(self, solve: Callable[[Array, Array], None], x: Array) -> Array:
        table = np.array(x, dtype=float, order="C").reshape(len(x), -1)
        solve(self.U, table)
        return table.reshape(np.shape(x))


def correlated(C: Array, G: Array) -> Array:
    """Covariance of G_a n_a with cov(n_a, n_b) = C_ab 1: from (s, s) and (s, r, q), (s r, s r)."""
    s, r, q = G.shape
    flat = G.reshape(s * r, q)
    return np.asarray((flat @ flat.T) * np.repeat(np.repeat(C, r, axis=0), r, axis=1))


def once_a_vector(method: Callable[[Owner, Array], Made]) -> Callable[[Owner, Array], Made]:
    """A method that keeps what it made of the last vector: residuals are asked for as rows are."""
    name = f"_{method.__name__}_of_last"

    @wraps(method)
    def kept(self: Owner, vector: Array) -> Made:
        last: tuple[bytes, Made] | None = vars(self).get(name)
        if last is None or last[0] != vector.tobytes():
            last = vector.tobytes(), method(self, vector)
            vars(self)[name] = last
        return last[1]

    return kept
