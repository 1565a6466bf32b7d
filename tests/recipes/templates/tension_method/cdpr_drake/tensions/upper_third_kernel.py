"""Tensions nearest to the upper third of their bounds."""

from __future__ import annotations

from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.tensions.closed_form_kernel import toward, within


@njit
def upper_third(
    work: Array,
    W: Array,
    w: Array,
    lower: Array,
    upper: Array,
    reference: Array,
    row_scale: Array,
    t: Array,
) -> int:
    """Writes the tensions t; 1 feasible, 0 missed, -2 singular W."""
    if not toward(W, w, lower + 2.0 / 3.0 * (upper - lower), t):
        return -2
    return 1 if within(t, lower, upper) else 0
