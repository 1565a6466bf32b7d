"""Numba kernel of a look for a broken cable: residuals of lengths, their limits, which cable it is.

With l the length of a cable's path at the believed pose, l0 and t its measured unstrained length
and tension,

    r = l - l0 (1 + t / (E S)) - b,

where b is the same at the last sample at which the cable pulled for certain: there it was 0 but for
what is wrong with the belief. A cable that never pulled has b of the first sample, or 0 if that is
below, since it may have been slack. What is wrong with exit and anchor points shows in r only as
far as the cable's direction u turned since, by |u - u_b|, with u_b = 0 where it never pulled.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.motion_kernel import Motion
from cdpr_drake.geometry.pulley_kernel import pulley_geometry

NOISE, POINTS, POSE, IN_A_ROW = range(4)
"""Of a rule: noise of r that counts, bound of errors of exit and anchor points together, and of how
far the error of the believed pose changes meanwhile [m]; samples in a row that make an alarm."""

RULE_SIZE = 4

COUNTS, RESIDUALS, LIMITS, FALLS, BASE, BEFORE, NAMED, PULLS, DIRECTION, MEMORY_ROWS = (
    0, 1, 2, 3, 4, 5, 6, 7, 8, 11,
)  # fmt: skip
"""Rows of a memory: samples in a row above the limit; r and its limit [m]; by how much the reading
fell in the one sample in which it fell silent [N], 0 if it did not; b [m]; the last reading [N],
NaN before any; 1 of the cable that is named; samples in a row in which that one pulls; u_b (3)."""

SHORTEST = 1e-12
"""As `cable_paths.SHORTEST` [m]."""


@njit(cache=True)
def break_step(
    X: Motion, cables: Array, lengths: Array, tensions: Array, silent: Array, rule: Array,
    memory: Array,
) -> int:  # fmt: skip
    """One sample; returns a cable that cannot run at the pose, or -1.

    Residuals raise the alarm; which cable it is the tensions tell: of those that read nothing, the
    one whose reading fell most in the one sample in which it fell silent, since a cable that breaks
    lets go at once, and others slacken after it. Where none fell, that which is farthest beyond its
    limit. One that pulls is whole: whoever was named and pulls is named no more, and the next one
    is looked for.

    Args:
        X: Believed pose, see `cable_paths.motion_of`.
        cables: `CableSet.packed()`, shape (m, 17).
        lengths: Measured unstrained lengths, shape (m,) [m].
        tensions: Measured, shape (m,) [N].
        silent: What sensors read at most of a cable that pulls nothing, shape (m,) [N].
        rule: Shape (`RULE_SIZE`,).
        memory: Shape (`MEMORY_ROWS`, m), as `break_detection.fresh_memory` at first; changed.
    """
    m, named = cables.shape[0], -1
    for i in range(m):
        t = tensions[i]
        geometry = pulley_geometry(X, cables[i])
        length = geometry[0] + geometry[1]
        if not (np.isfinite(length) and length > SHORTEST):
            return i
        found = length - lengths[i] * (1.0 + t / cables[i, 6])
        nothing, first = t <= silent[i], np.isnan(memory[BEFORE, i])
        if not nothing or first:
            memory[BASE, i] = max(found, 0.0) if nothing else found
            for k in range(3):
                memory[DIRECTION + k, i] = 0.0 if nothing else geometry[5 + k]
        turned = 0.0
        for k in range(3):
            turned += (geometry[5 + k] - memory[DIRECTION + k, i]) ** 2
        r = found - memory[BASE, i]
        limit = rule[NOISE] + rule[POSE] + rule[POINTS] * np.sqrt(turned)
        memory[RESIDUALS, i], memory[LIMITS, i] = r, limit
        if not nothing:
            memory[FALLS, i] = 0.0
        elif not first and memory[BEFORE, i] > silent[i]:
            memory[FALLS, i] = memory[BEFORE, i] - t
        memory[COUNTS, i] = memory[COUNTS, i] + 1.0 if nothing and r > limit else 0.0
        memory[BEFORE, i] = t
        if memory[NAMED, i] != 0.0:
            memory[PULLS, i] = 0.0 if nothing else memory[PULLS, i] + 1.0
            if memory[PULLS, i] >= rule[IN_A_ROW]:
                memory[NAMED, i] = memory[PULLS, i] = 0.0
            else:
                named = i
    if named >= 0 or np.max(memory[COUNTS]) < rule[IN_A_ROW]:
        return -1
    named = int(np.argmax(memory[FALLS]))
    if memory[FALLS, named] == 0.0:
        beyond = -np.inf
        for i in range(m):
            over = memory[RESIDUALS, i] - memory[LIMITS, i]
            if memory[COUNTS, i] > 0.0 and over > beyond:
                named, beyond = i, over
    memory[NAMED, named] = 1.0
    return -1
