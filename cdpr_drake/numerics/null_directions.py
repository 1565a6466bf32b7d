"""Directions in which nothing is known, in few words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import qr

from cdpr_drake.arrays import Array

SHARE = 0.05
"""A parameter with less than this share of a direction's largest one is not named."""


def sparse_basis(N: Array) -> Array:
    """The same columns combined so that each has few entries, shape (f, d)."""
    if not N.shape[1]:
        return N
    _, _, pivots = qr(N.T, pivoting=True, mode="economic")
    rows = np.sort(pivots[: N.shape[1]])
    return np.asarray(N @ np.linalg.inv(N[rows]))


def named_direction(direction: Array, words: Sequence[str]) -> str:
    """A direction of parameters, shape (f,), as a sentence: what cannot be told from what."""
    size = np.abs(direction)
    members = [i for i in np.argsort(-size, kind="stable") if size[i] > SHARE * np.max(size)]
    first, others = str(words[members[0]]), [str(words[i]) for i in members[1:]]
    if not others:
        return f"{first} cannot be told at all"
    shown = others[:3]
    more = f" and {len(others) - 3} more" if len(others) > 3 else ""
    return f"{first} cannot be told from {', '.join(shown)}{more}"
