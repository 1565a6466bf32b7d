"""A platform of which any one cable may break: the cases that are left, and what they must hold.

Notation of `static_feasibility`. With W the wrench matrix and d what is demanded of the cables, a
pose survives every single break where tensions lower <= t <= upper with W t = d exist for all
cables, and for each set of m - 1 of them. The first does not follow from the rest, for a cable
that is there pulls with its smallest tension at least.

Robots with two cables more than degrees of freedom seldom have such a pose: of eight cables of a
suspended robot each carries a part of the space. `breaks_survived` counts, pose by pose, the single
breaks after which the rest holds the platform.

All of it says where the platform can stand on the cables that are left, not that it gets there:
what happens between the break and the new rest is a matter of dynamics.

Source: Boumann and Bruckmann, Development of emergency strategies for cable-driven parallel robots
after a cable break, 2019, for the static workspace of the cables that are left.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet, resisting
from cdpr_drake.workspaces.static_feasibility import StaticCase, statically_feasible
from cdpr_drake.workspaces.wrench_capacity import capacity_margins


def without_cable(case: StaticCase, cable: int) -> StaticCase:
    """The same platform on the cables that are left.

    Args:
        case: Platform, load and tension bounds.
        cable: Number of the broken cable, from 0.

    Raises:
        WorkspaceError: There is no such cable.
        TensionProblemError: Fewer cables than degrees of freedom are left.
    """
    if not 0 <= cable < case.cables.count:
        raise WorkspaceError(f"cable: found {cable}; accepted: 0 to {case.cables.count - 1}")
    left = np.arange(case.cables.count) != cable
    lower, upper = case.bounds()
    return replace(case, cables=case.cables.chosen(left), lower=lower[left], upper=upper[left])


def cases_after_breaks(case: StaticCase) -> tuple[StaticCase, ...]:
    """The case with all cables, and with each single one broken, m + 1 of them.

    Raises:
        WorkspaceError: No cable is more than the degrees of freedom need.
    """
    n, m = len(case.rows), case.cables.count
    if m <= n:
        raise WorkspaceError(
            f"single-failure: found {m} cables for {n} degrees of freedom; accepted: more than {n}"
        )
    return (case, *(without_cable(case, cable) for cable in range(m)))


def survives_breaks(
    case: StaticCase, positions: Array, rotations: Array, required: SpatialSet | None = None
) -> np.ndarray:
    """Whether weight and wrenches are held with all cables and with any one broken, shape (n,).

    Args:
        case: Platform, load and tension bounds.
        positions: p_WP, shape (n, 3) [m].
        rotations: R_WP, shape (n, 3, 3).
        required: Wrenches to resist beside the load; None: none.

    Raises:
        WorkspaceError: No cable is more than the degrees of freedom need.
        TensionProblemError: The tension bounds make no sense.
    """
    positions = np.asarray(positions, float).reshape(-1, 3)
    rotations = np.asarray(rotations, float).reshape(-1, 3, 3)
    held = np.ones(len(positions), bool)
    for one in cases_after_breaks(case):
        at = np.flatnonzero(held)  # a pose that one case loses is asked for no other
        if not len(at):
            break
        held[at] = _held(one, positions[at], rotations[at], required)
    return held


def breaks_survived(
    case: StaticCase, positions: Array, rotations: Array, required: SpatialSet | None = None
) -> np.ndarray:
    """Of how many single breaks weight and wrenches are still held, shape (n,), 0 to m.

    0 too where not even all cables hold them. Arguments and errors as of `survives_breaks`.
    """
    positions = np.asarray(positions, float).reshape(-1, 3)
    rotations = np.asarray(rotations, float).reshape(-1, 3, 3)
    whole, *broken = cases_after_breaks(case)
    held = _held(whole, positions, rotations, required)
    counts = np.zeros(len(positions), int)
    at = np.flatnonzero(held)
    for one in broken:
        counts[at] += _held(one, positions[at], rotations[at], required)
    return counts


def _held(
    case: StaticCase, positions: Array, rotations: Array, required: SpatialSet | None
) -> np.ndarray:
    if required is None:
        return statically_feasible(case, positions, rotations)
    demand = resisting(case, required, rotations)
    return capacity_margins(case, positions, rotations, demand).feasible


def break_margins(
    case: StaticCase, positions: Array, rotations: Array, required: SpatialSet | None = None
) -> Array:
    """Least capacity margin of the m + 1 cases, shape (n,) [N]; negative: one of them fails.

    Each case divides moments by its own `StaticCase.arm`. Arguments and errors as of
    `survives_breaks`.
    """
    rotations = np.asarray(rotations, float).reshape(-1, 3, 3)
    asked = required or SpatialSet()
    margins = [
        capacity_margins(one, positions, rotations, resisting(one, asked, rotations)).margins
        for one in cases_after_breaks(case)
    ]
    return np.asarray(np.min(margins, axis=0))
