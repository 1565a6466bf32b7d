"""Facets of the set of wrenches that cables can give, as numba kernels for any m cables, n rows.

The set {W t : lower <= t <= upper} is a zonotope. Each of its facets is normal to n - 1 columns of
W, so the generalized cross products of all choices of n - 1 columns are all normals that there are,
both signs of each. A column's wedge product with those before it is formed once for all choices
that begin with them.

Along any normal c the zonotope reaches sum_i max(lower_i c'W_i, upper_i c'W_i), whatever the rank
of W: no facet is ever too near, and a choice of columns that determine no normal is left out, since
a facet that they lie in has others that do.

Source: Bouchard, Gosselin and Moore, On the ability of a cable-driven robot to generate a
prescribed set of wrenches, 2010 (hyperplane shifting method); Guay et al., Measuring how well a
structure supports varying external wrenches, 2014 (capacity margin).
"""

from __future__ import annotations

from functools import cache
from itertools import combinations
from math import comb

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array

DEPENDENT = 1e-11
"""n - 1 columns determine no normal where their cross product is shorter, relative to the product
of their lengths; far above the product's rounding, about n 1e-16."""


@cache
def wedge_terms(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Terms of the wedge product of k - 1 columns with one more, for k = 1 to n.

    Returns:
        Rows (component of the result, row of the new column, component of the old product, sign),
        and where those of k begin, shape (n + 2,). Components of a product of k columns are the
        minors of k rows, in the order of `itertools.combinations`.
    """
    found, starts = [], [0, 0]
    for k in range(1, n + 1):
        before = {rows: i for i, rows in enumerate(combinations(range(n), k - 1))}
        for number, rows in enumerate(combinations(range(n), k)):
            for place, row in enumerate(rows):
                rest = (*rows[:place], *rows[place + 1 :])
                found.append((number, row, before[rest], (-1) ** (k - 1 - place)))
        starts.append(len(found))
    return np.array(found, np.int64), np.array(starts, np.int64)


def facet_count(n: int, m: int) -> int:
    """How many choices of n - 1 of m columns there are."""
    return comb(m, n - 1)


@njit(cache=True, nogil=True)
def facet_normals(
    W: Array, terms: Array, starts: Array, wedge: Array, chosen: Array, out: Array
) -> float:
    """Writes a unit normal for each choice of n - 1 columns; zeros where they determine none.

    Args:
        W: Shape (n, m), n >= 2.
        terms: Of `wedge_terms(n)`.
        starts: Of `wedge_terms(n)`.
        wedge: Work space, shape (n + 1, 20) or wider: largest binomial of n.
        chosen: Work space, whole numbers, shape (n,).
        out: Normals in the order of `itertools.combinations`, shape (facet_count(n, m), n).

    Returns:
        Largest of the cross products' relative lengths; 0: W has not rank n - 1.
    """
    n, m = W.shape
    wedge[0, 0] = 1.0
    for k in range(n - 1):
        chosen[k] = k
    changed, number, largest = 0, 0, 0.0
    while True:
        for k in range(changed, n - 1):
            column = chosen[k]
            size = 0.0
            for row in range(n):
                size += W[row, column] * W[row, column]
            per = 1.0 / np.sqrt(size) if size > 0.0 else 0.0
            for term in range(starts[k + 1], starts[k + 2]):
                wedge[k + 1, terms[term, 0]] = 0.0
            for term in range(starts[k + 1], starts[k + 2]):
                wedge[k + 1, terms[term, 0]] += (
                    terms[term, 3] * per * W[terms[term, 1], column] * wedge[k, terms[term, 2]]
                )
        square = 0.0
        for row in range(n):
            square += wedge[n - 1, row] * wedge[n - 1, row]
        length = np.sqrt(square)
        largest = max(largest, length)
        for row in range(n):  # the minor without this row is the last but `row` of the minors
            value = wedge[n - 1, n - 1 - row] / length if length > DEPENDENT else 0.0
            out[number, row] = value if (n - 1 - row) % 2 == 0 else -value
        number += 1
        k = n - 2
        while k >= 0 and chosen[k] == m - (n - 1) + k:
            k -= 1
        if k < 0:
            return largest
        chosen[k] += 1
        for j in range(k + 1, n - 1):
            chosen[j] = chosen[j - 1] + 1
        changed = k


@njit(cache=True, nogil=True)
def margin_along(
    c: Array, W: Array, lower: Array, upper: Array, points: Array, spread: Array
) -> tuple[float, float, int, int]:
    """Room between demanded wrenches and both facets normal to c.

    Args:
        c: Unit normal, shape (n,).
        W: Wrench matrix, shape (n, m).
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        points: Demanded wrenches W t, shape (k, n).
        spread: How the set round each point is made, shape (n + 2, n): see `demand_reach`.

    Returns:
        Room along c and along -c, and the points that have the least.
    """
    n, m = W.shape
    top = bottom = 0.0
    for i in range(m):
        q = 0.0
        for row in range(n):
            q += c[row] * W[row, i]
        if q > 0.0:
            top += upper[i] * q
            bottom += lower[i] * q
        else:
            top += lower[i] * q
            bottom += upper[i] * q
    highest, lowest, most, least = -np.inf, np.inf, 0, 0
    for k in range(points.shape[0]):
        value = 0.0
        for row in range(n):
            value += c[row] * points[k, row]
        if value > highest:
            highest, most = value, k
        if value < lowest:
            lowest, least = value, k
    reach = demand_reach(c, spread)
    return top - highest - reach, lowest - reach - bottom, most, least


@njit(cache=True, nogil=True)
def demand_reach(c: Array, spread: Array) -> float:
    """How far the set round a demanded point reaches along c, the same to both sides.

    The set is {T (b + e)}: |b_j| <= half_j, and e in the ellipsoid of semi-axes a_j.

    Args:
        c: Shape (n,).
        spread: T, then half, then a below it, shape (n + 2, n).
    """
    n = c.shape[0]
    box = square = 0.0
    for j in range(n):
        y = 0.0
        for row in range(n):
            y += spread[row, j] * c[row]
        box += abs(y) * spread[n, j]
        square += (y * spread[n + 1, j]) ** 2
    return box + np.sqrt(square)


@njit(cache=True, nogil=True)
def many_margins(
    first: int, past: int, W: Array, lower: Array, upper: Array, points: Array, spread: Array,
    terms: Array, starts: Array, margins: Array, worst: Array, full: Array,
) -> None:  # fmt: skip
    """Writes the capacity margins of many poses, for `kernel_calls.over_rows`.

    Args:
        first: First pose.
        past: One past the last.
        W: Wrench matrices, scaled, shape (k, n, m); NaN where a cable cannot run.
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        points: Demanded wrenches, scaled, shape (k, p, n).
        spread: Sets round them, shape (k, n + 2, n), see `demand_reach`, or one for all poses.
        terms: Of `wedge_terms(n)`.
        starts: Of `wedge_terms(n)`.
        margins: Gets the margins, shape (k,) [N]; minus infinity without any normal.
        worst: Gets the outward normals with the least room, then the number of the point,
            shape (k, n + 1).
        full: Gets how thick the set is, shape (k,): the least over all normals of the largest
            column along it, of the cables whose tension can change; 0 where it is flat.
    """
    _, n, m = W.shape
    count = 1
    for k in range(n - 1):
        count = count * (m - k) // (k + 1)
    normals = np.empty((count, n))
    wedge, chosen = np.empty((n + 1, 20)), np.empty(n, np.int64)
    for pose in range(first, past):
        margins[pose], full[pose] = -np.inf, 0.0
        worst[pose] = 0.0
        finite = True
        for row in range(n):
            for i in range(m):
                finite = finite and np.isfinite(W[pose, row, i])
        if not finite:
            continue
        around = spread[min(pose, spread.shape[0] - 1)]
        facet_normals(W[pose], terms, starts, wedge, chosen, normals)
        best, thin, any_normal = np.inf, np.inf, False
        for number in range(count):
            c = normals[number]
            present = False
            for row in range(n):
                present = present or c[row] != 0.0
            if not present:
                continue
            any_normal = True
            widest = 0.0
            for i in range(m):
                q = 0.0
                for row in range(n):
                    q += c[row] * W[pose, row, i]
                if upper[i] > lower[i]:
                    widest = max(widest, abs(q))
            thin = min(thin, widest)
            up, down, most, least = margin_along(c, W[pose], lower, upper, points[pose], around)
            if up < best:
                best = up
                worst[pose, :n], worst[pose, n] = c, most
            if down < best:
                best = down
                for row in range(n):
                    worst[pose, row] = -c[row]
                worst[pose, n] = least
        if any_normal:
            margins[pose], full[pose] = best, thin


@njit(cache=True, nogil=True)
def many_closures(first: int, past: int, W: Array, terms: Array, starts: Array, out: Array) -> None:
    """Writes how far W is from losing wrench closure, for `kernel_calls.over_rows`.

    That is the least, over all normals, of how far the columns reach to both sides; columns are of
    their own length. Positive: positive tensions can balance every wrench. Arguments as
    `many_margins`; out has shape (k,).

    Source: Gouttefarde and Gosselin, Analysis of the wrench-closure workspace of planar parallel
    cable-driven mechanisms, 2006 (a cone that is not all of space has a facet).
    """
    _, n, m = W.shape
    count = 1
    for k in range(n - 1):
        count = count * (m - k) // (k + 1)
    normals = np.empty((count, n))
    wedge, chosen = np.empty((n + 1, 20)), np.empty(n, np.int64)
    for pose in range(first, past):
        out[pose] = -np.inf
        finite = True
        for row in range(n):
            for i in range(m):
                finite = finite and np.isfinite(W[pose, row, i])
        if not finite:
            continue
        facet_normals(W[pose], terms, starts, wedge, chosen, normals)
        best = np.inf
        for number in range(count):
            present, high, low = False, 0.0, 0.0
            for row in range(n):
                present = present or normals[number, row] != 0.0
            for i in range(m):
                q = 0.0
                for row in range(n):
                    q += normals[number, row] * W[pose, row, i]
                high, low = max(high, q), min(low, q)
            if present:
                best = min(best, high, -low)
        if best < np.inf:
            out[pose] = best


@njit(cache=True, nogil=True)
def many_reaches(
    first: int, past: int, W: Array, lower: Array, upper: Array, points: Array, along: Array,
    terms: Array, starts: Array, out: Array,
) -> None:  # fmt: skip
    """Writes how far one can go from a point inside along a direction.

    For `kernel_calls.over_rows`.

    Args:
        first: First pose.
        past: One past the last.
        W: Wrench matrices, scaled, shape (k, n, m).
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        points: Where to begin, scaled, shape (k, n).
        along: Directions, scaled alike, shape (k, n).
        terms: Of `wedge_terms(n)`.
        starts: Of `wedge_terms(n)`.
        out: Multiples of `along`, shape (k,): infinite if no facet is met, NaN from outside.
    """
    _, n, m = W.shape
    count = 1
    for k in range(n - 1):
        count = count * (m - k) // (k + 1)
    normals = np.empty((count, n))
    wedge, chosen = np.empty((n + 1, 20)), np.empty(n, np.int64)
    still = np.zeros((n + 2, n))
    point = np.empty((1, n))
    for pose in range(first, past):
        out[pose] = np.nan
        finite = True
        for row in range(n):
            for i in range(m):
                finite = finite and np.isfinite(W[pose, row, i])
        if not finite:
            continue
        facet_normals(W[pose], terms, starts, wedge, chosen, normals)
        point[0] = points[pose]
        farthest, any_normal = np.inf, False
        for number in range(count):
            rate, present = 0.0, False
            for row in range(n):
                rate += normals[number, row] * along[pose, row]
                present = present or normals[number, row] != 0.0
            if not present:
                continue
            any_normal = True
            up, down, _, _ = margin_along(normals[number], W[pose], lower, upper, point, still)
            if up < 0.0 or down < 0.0:
                farthest = np.nan
                break
            if rate > 0.0:
                farthest = min(farthest, up / rate)
            elif rate < 0.0:
                farthest = min(farthest, down / -rate)
        if any_normal:
            out[pose] = farthest
