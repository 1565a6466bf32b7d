"""The inextensible catenary by its length, and its length by how far it hangs down."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array

ITERATIONS = 12
"""Of Newton's method for the catenary, and of Gauss and Newton's for its length; both converge from
their parabolas within a few."""

FLAT = 1e-7
"""Surplus over the distance of the ends up to which a catenary is a parabola: by so much less than
its drop do they differ, and round-off of the catenary is larger."""

SMALLEST_ROOT = 1e-5
"""Root of the surplus below which there is none: a tenth of a nanometre [m^0.5]."""

DIFFERENCE = 1e-6
"""Step of the derivative by the root of the surplus [m^0.5]."""


def catenary_drop(x: Array, span: float, rise: float, surplus: float) -> Array:
    """How far a hanging cable is below the line between its ends, shape (n,) [m].

    Args:
        x: Horizontal distances from the first end, shape (n,) [m].
        span: Horizontal distance of the ends, positive [m].
        rise: How much higher the second end is [m].
        surplus: Length less the distance of the ends, not negative [m].

    Source: Irvine, Cable Structures, 1981, 1.1: z = a cosh((x - x0) / a) + c, with
    L^2 = rise^2 + (2 a sinh(span / 2a))^2.
    """
    chord = float(np.hypot(span, rise))
    if surplus < FLAT * chord:
        middle = np.sqrt(max(surplus, 0.0)) * _per_root(span, chord)
        return np.asarray(4.0 * middle * x * (span - x) / span**2)
    line, length = rise * x / span, chord + surplus
    # More than 1, and 1 + xi^2 / 6 + xi^4 / 120 + ... of xi = span / 2a.
    ratio = np.sqrt(length**2 - rise**2) / span
    xi = np.sqrt(6.0 * (ratio - 1.0)) if ratio < 3.0 else np.log(2.0 * ratio) + 1.0
    for _ in range(ITERATIONS):
        xi -= (np.sinh(xi) - ratio * xi) / (np.cosh(xi) - ratio)
    a = span / (2.0 * xi)
    x0 = span / 2.0 - a * np.arcsinh(rise / (2.0 * a * np.sinh(xi)))
    return np.asarray(line - a * (np.cosh((x - x0) / a) - np.cosh(x0 / a)))


def surplus_of_drops(x: Array, drops: Array, span: float, rise: float) -> tuple[float, Array]:
    """Surplus of the catenary that hangs closest to some points, by least squares.

    Args:
        x: Horizontal distances of points from the first end, shape (n,) [m].
        drops: How far they are below the line between the ends, shape (n,) [m].
        span: Horizontal distance of the ends, positive [m].
        rise: How much higher the second end is [m].

    Returns:
        Surplus [m], 0 where they lie above the line, and what it changes by each drop, shape (n,).
    """
    chord = float(np.hypot(span, rise))
    bow = 4.0 * x * (span - x) / span**2
    middle = float(bow @ drops / (bow @ bow))
    # Of a parabola; the drop grows with the root of the surplus, which so is what is looked for.
    root = middle / _per_root(span, chord)
    if root <= SMALLEST_ROOT:
        return 0.0, np.zeros_like(x)
    for _ in range(ITERATIONS):
        slope = _slope(x, span, rise, root)
        change = slope @ (drops - catenary_drop(x, span, rise, root**2)) / (slope @ slope)
        root = max(root + float(change), 0.1 * root)
        if abs(change) < 1e-9:
            break
    slope = _slope(x, span, rise, root)
    return root**2, 2.0 * root * slope / (slope @ slope)


def _per_root(span: float, chord: float) -> float:
    """Drop of a flat parabola's middle by the root of its surplus, for ends so far apart [m^0.5].

    Source: Irvine, Cable Structures, 1981, 2.1: surplus = 8 middle^2 span^2 / (3 chord^3).
    """
    return float(chord**1.5 / (np.sqrt(8.0 / 3.0) * span))


def _slope(x: Array, span: float, rise: float, root: float) -> Array:
    """Derivative of the drops by the root of the surplus, shape (n,) [m^0.5]."""
    step = min(DIFFERENCE, 0.5 * root)
    after, before = (catenary_drop(x, span, rise, (root + s) ** 2) for s in (step, -step))
    return np.asarray((after - before) / (2.0 * step))
