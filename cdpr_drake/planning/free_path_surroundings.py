"""What a free motion stays off: obstacles, its own cables, the edge of an image.

Each gives a function of a point of the motion, on any scalar, and words for its rows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd, ExtractValue
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.planning.free_path_terms import Capsule, FreeTerms, segments_gap

SHARED = 1e-9
"""Cables whose exit or anchor points are nearer share it, and always touch there [m]."""

Gaps = tuple[Callable[[Any], Any], list[str]]


def obstacle_gaps(
    terms: FreeTerms, obstacles: Sequence[Capsule], platform: tuple[Array, float], names: list[str]
) -> Gaps:
    """Distances of cables and of a ball around the platform from obstacles [m].

    Args:
        terms: Of the motion.
        obstacles: What stands in the way.
        platform: The ball: its middle in P, shape (3,), and its radius [m].
        names: Of the cables.
    """
    middle, radius = np.asarray(platform[0], float), float(platform[1])
    A = terms.cables.p_WA.T

    def gaps(point: Any) -> Any:
        ball = terms.from_platform(point, middle)
        found = []
        for one in obstacles:
            fixed = (np.asarray(one.start, float), np.asarray(one.end, float))
            for begin, B in zip(A, terms.ends(point), strict=True):
                gap = segments_gap((begin, B), fixed, [begin, _value(B), *fixed])
                found.append(gap - one.radius)
            here = _value(ball)
            gap = segments_gap((ball, ball), fixed, [here, here, *fixed])
            found.append(gap - one.radius - radius)
        return np.array(found)

    words = [
        f"{who} and obstacle {number}"
        for number in range(1, len(obstacles) + 1)
        for who in (*names, "the platform")
    ]
    return gaps, words


def cable_gaps(terms: FreeTerms, names: list[str]) -> Gaps:
    """Distances of the centre lines of cables that share no point [m]."""
    A, B = terms.cables.p_WA.T, terms.cables.p_PB.T
    pairs = [
        (i, j)
        for i, j in combinations(range(len(A)), 2)
        if np.linalg.norm(A[i] - A[j]) > SHARED and np.linalg.norm(B[i] - B[j]) > SHARED
    ]

    def gaps(point: Any) -> Any:
        ends = terms.ends(point)
        plain = [_value(end) for end in ends]
        return np.array([
            segments_gap((A[i], ends[i]), (A[j], ends[j]), [A[i], plain[i], A[j], plain[j]])
            for i, j in pairs
        ])  # fmt: skip

    return gaps, [f"{names[i]} and {names[j]}" for i, j in pairs]


def view_gaps(
    terms: FreeTerms,
    X_PC: RigidTransform,
    slopes: tuple[float, float],
    points: Array,
    nearest: float,
) -> Gaps:
    """How far points of W are within the view of a camera; arguments as of `AddFieldOfView`."""
    R, p = X_PC.rotation().matrix(), X_PC.translation()
    each = np.asarray(points, float).T

    def seen(point: Any) -> Any:
        found = []
        for Q in each:
            x, y, z = R.T @ (terms.in_platform(point, Q) - p)
            found += [slopes[0] * z - x, slopes[0] * z + x]
            found += [slopes[1] * z - y, slopes[1] * z + y, z - nearest]
        return np.array(found)

    sides = ("right", "left", "lower", "upper", "near")
    return seen, [f"point {k}, {side} edge" for k in range(1, len(each) + 1) for side in sides]


def _value(x: Any) -> Array:
    """Numbers of an array that may carry derivatives."""
    if x.dtype == object and isinstance(x[0], AutoDiffXd):
        return np.ascontiguousarray(ExtractValue(x).ravel())
    return np.ascontiguousarray(x, dtype=float)
