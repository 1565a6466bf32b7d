"""What a log cannot tell, in words, and why."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.identification.motion_term import MotionTerm
from cdpr_drake.identification.parameters import Layout
from cdpr_drake.identification.terms import Term
from cdpr_drake.numerics.null_directions import named_direction, sparse_basis

UNTOLD = 1.0
"""A direction is told where its standard deviation is below this many typical sizes."""

LITTLE_TURN = np.radians(2.0)
LITTLE_ACCELERATION = 0.05
"""Turns [rad] and accelerations, over gravity, that count as none."""


def unidentifiable_words(
    layout: Layout, theta: Array, Z: Array, H: Array, terms: Sequence[Term]
) -> tuple[str, ...]:
    """What information leaves open, in words with the reason where it is known.

    Args:
        layout: The unknown vector.
        theta: Where it stands.
        Z: Directions that are free, over typical sizes, shape (n, f).
        H: Information along them, shape (f, f).
        terms: What was measured.
    """
    typical = np.array([p.size for p in layout.parameters])
    J = layout.jacobian(theta, layout.typical[:, None] * Z) / typical[:, None]
    back = np.linalg.inv(J)
    values, V = np.linalg.eigh(back.T @ H @ back)
    N = V[:, values < 1.0 / UNTOLD**2]
    words = [p.words for p in layout.parameters]
    why = _reason(terms)
    return tuple(named_direction(v, words) + why for v in sparse_basis(N).T)


def _reason(terms: Sequence[Term]) -> str:
    for term in terms:
        if isinstance(term, MotionTerm):
            s = term.samples
            turned = np.einsum("ij,nij->n", s.R_WP[0], s.R_WP)
            turn = float(np.max(np.arccos(np.clip(0.5 * (turned - 1.0), -1.0, 1.0))))
            if turn < LITTLE_TURN:
                return ": no rotation in the log"
            gravity = max(float(np.linalg.norm(term.gravity)), 1.0)
            fast = float(np.sqrt(np.mean(s.A_WP[:, 3:] ** 2))) / gravity
            if fast < LITTLE_ACCELERATION:
                return ": hardly any acceleration in the log"
            return ""
    return ""
