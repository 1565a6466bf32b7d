"""Numba kernels for cables between any bodies: wrenches on them, what the cables do, and lengths.

A cable is one segment or several, see `geometry.CableRoutes`. A segment is a cable of
`CableSet.packed()`, seen from the body with its exit point: that body's frame stands for the world,
and the body with the anchor point moves in it. So the laws of `dispatch_kernel` need not know what
moves. The pull is turned back into W; the body with the exit point gets the opposite wrench. A
cable that sags is seen in axes of W, since its plane is vertical, and its exit point gets its
weight besides. A cable over eyelets is straight, with one tension that follows from its length, the
sum of those of its segments:

    t = E S (e + T de/dt),   e = l / l0 - 1,   l = sum_k l_k,   where e > 0 and t > 0, else 0.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.cables.dispatch_kernel import cable_energy, cable_motion, slack_tension
from cdpr_drake.cables.hanging_kernel import SENSITIVITIES
from cdpr_drake.cables.models import HANGING, STRAIGHT
from cdpr_drake.cables.response_kernel import DERIVATIVES, straight_motion
from cdpr_drake.cables.simulation_kernel import write_outputs
from cdpr_drake.cables.straight_kernel import cable_pull
from cdpr_drake.geometry.motion_kernel import Motion
from cdpr_drake.geometry.pulley_kernel import LINEAR_WEIGHT, pulley_line
from cdpr_drake.geometry.tree_kernel import (
    TREE_WORK,
    add_tree_force,
    motion_from_point,
    motion_of_row,
    relative_motion,
    tree_motion,
)
from cdpr_drake.numerics.kernel_calls import array_addresses, integers_at, matrix_at, vector_at

_LAW, _PLAIN, _GUESSES = 0, 1, 2
_LINE = 7
_INNER, _OUTER = 3 * SENSITIVITIES, 4 * DERIVATIVES
_ROW = 17


def make_route_room(segments: Array, cables: int, law: int, dtype: Any = float) -> Array:
    """Settings of the kernels and their room to work in, as one array.

    Args:
        segments: From `CableRoutes.packed`, shape (s, 17).
        cables: Number of cables.
        law: Number of their law, see `CableModel`.
        dtype: object for scalars other than float.
    """
    s = len(segments)
    room = np.zeros(_GUESSES + 2 * s + _LINE * s + _ROW + _INNER + _OUTER, dtype=dtype)
    pulleys = bool(np.any(segments[:, 8] > 0.0) or np.any(segments[:, 13] > 0.0))
    room[_LAW], room[_PLAIN] = law, float(law == STRAIGHT and not pulleys and s == cables)
    return room


@njit(cache=True)
def _parts(room: Array, s: int) -> Any:
    a = _GUESSES + 2 * s
    b = a + _LINE * s
    c = b + _ROW
    d = c + _INNER
    return (
        room[_GUESSES:a].reshape(s, 2),
        room[a:b].reshape(s, _LINE),
        room[b:c],
        room[c:d].reshape(SENSITIVITIES, 3),
        room[d : d + _OUTER].reshape(DERIVATIVES, 4),
    )


@njit(cache=True)
def _add_pull(
    motion: Array, e: int, b: int, p: Any, r: Any, turned: bool, weight: float, exit_point: Array,
    wrenches: Array,
) -> None:  # fmt: skip
    """Adds what a segment with pull p and arm r does to its two bodies.

    Args:
        motion: Motions of the tree, shape (n, 18).
        e: Row of the body with the exit point.
        b: Row of the body with the anchor point.
        p: Pull along the cable, minus the force on the anchor body, (3,) [N].
        r: Arm from Bo to where it pulls, (3,) [m].
        turned: Whether p and r are in axes of the exit body; else in those of W.
        weight: Of the cable, which the exit point carries besides [N].
        exit_point: In the exit body's frame, shape (3,) [m].
        wrenches: Moments about Bo and forces in W, shape (n, 6).
    """
    px, py, pz = p
    rx, ry, rz = r
    E, B = motion[e], motion[b]
    if turned:
        px, py, pz = (
            E[0] * px + E[1] * py + E[2] * pz,
            E[3] * px + E[4] * py + E[5] * pz,
            E[6] * px + E[7] * py + E[8] * pz,
        )
        rx, ry, rz = (
            E[0] * rx + E[1] * ry + E[2] * rz,
            E[3] * rx + E[4] * ry + E[5] * rz,
            E[6] * rx + E[7] * ry + E[8] * rz,
        )
    w = wrenches[b]
    w[0] = w[0] - (ry * pz - rz * py)
    w[1] = w[1] - (rz * px - rx * pz)
    w[2] = w[2] - (rx * py - ry * px)
    w[3] = w[3] - px
    w[4] = w[4] - py
    w[5] = w[5] - pz
    if e == 0:
        return
    if turned:  # on one line with what the anchor body gets
        ax, ay, az = B[9] + rx - E[9], B[10] + ry - E[10], B[11] + rz - E[11]
    else:
        a = exit_point
        ax = E[0] * a[0] + E[1] * a[1] + E[2] * a[2]
        ay = E[3] * a[0] + E[4] * a[1] + E[5] * a[2]
        az = E[6] * a[0] + E[7] * a[1] + E[8] * a[2]
        pz = pz - weight
    w = wrenches[e]
    w[0] = w[0] + (ay * pz - az * py)
    w[1] = w[1] + (az * px - ax * pz)
    w[2] = w[2] + (ax * py - ay * px)
    w[3] = w[3] + px
    w[4] = w[4] + py
    w[5] = w[5] + pz


@njit(cache=True)
def _seen(motion: Array, e: int, b: int) -> Motion:
    """The motion of the anchor body as the exit body sees it."""
    if e == 0:
        return motion_of_row(motion[b])
    return relative_motion(motion[e], motion[b])


@njit(cache=True)
def _write_lines(motion: Array, segments: Array, ends: Array, lines: Array) -> None:
    """Length [m], unit vector and arm in the exit body's axes of each segment, shape (s, 7)."""
    for k in range(segments.shape[0]):
        X = _seen(motion, ends[k, 0], ends[k, 1])
        length, ux, uy, uz, rx, ry, rz = pulley_line(X, segments[k])
        line = lines[k]
        line[0], line[1], line[2], line[3] = length, ux, uy, uz
        line[4], line[5], line[6] = rx, ry, rz


@njit(cache=True, error_model="numpy")
def _tension_through(
    motion: Array, cable: Array, ends: Array, lines: Array, l0: float, l0_dot: float
) -> Any:
    """Tension [N] and length [m] of a straight cable over eyelets, of these segments."""
    length = 0.0 * l0
    for k in range(lines.shape[0]):
        length = length + lines[k, 0]
    strain = length / l0 - 1.0
    t = 0.0 * strain
    if strain > 0.0:
        rate = 0.0 * strain
        for k in range(lines.shape[0]):
            X = _seen(motion, ends[k, 0], ends[k, 1])
            ux, uy, uz = lines[k, 1], lines[k, 2], lines[k, 3]
            rx, ry, rz = lines[k, 4], lines[k, 5], lines[k, 6]
            rate = rate + (
                ux * (X[15] + X[13] * rz - X[14] * ry)
                + uy * (X[16] + X[14] * rx - X[12] * rz)
                + uz * (X[17] + X[12] * ry - X[13] * rx)
            )
        t = cable[6] * (strain + cable[7] * (rate - length * l0_dot / l0) / l0)
        t = max(t, 0.0 * t)
    return t, length


@njit(cache=True)
def _hanging(
    motion: Array, segment: Array, e: int, b: int, l0: float, l0_dot: float,
    guess: Array, row: Array, inner: Array, D: Array,
) -> Any:  # fmt: skip
    """`cable_motion` of a cable that sags, pull and arm in axes of W."""
    if e == 0:
        return cable_motion(HANGING, motion_of_row(motion[b]), segment, l0, l0_dot, guess, inner, D)
    row[:] = segment
    row[:3] = 0.0
    X = motion_from_point(motion[e], motion[b], segment[:3])
    return cable_motion(HANGING, X, row, l0, l0_dot, guess, inner, D)


@njit(cache=True)
def _plain_wrenches(
    motion: Array, l0: Array, l0_dot: Array, segments: Array, ends: Array, wrenches: Array
) -> None:
    """Straight cables without pulleys and eyelets, with the arithmetic of `floating_force`."""
    for i in range(segments.shape[0]):
        e, b = ends[i, 0], ends[i, 1]
        if e == b:
            continue
        X = _seen(motion, e, b)
        t, _, ux, uy, uz, rx, ry, rz = cable_pull(X, segments[i], l0[i], l0_dot[i])
        if e != 0:
            p, r = (t * ux, t * uy, t * uz), (rx, ry, rz)
            _add_pull(motion, e, b, p, r, True, 0.0, segments[i], wrenches)
            continue
        w = wrenches[b]
        w[3] = w[3] - t * ux
        w[4] = w[4] - t * uy
        w[5] = w[5] - t * uz
        w[0] = w[0] - t * (ry * uz - rz * uy)
        w[1] = w[1] - t * (rz * ux - rx * uz)
        w[2] = w[2] - t * (rx * uy - ry * ux)


@njit(cache=True)
def add_straight_wrenches(
    motion: Array, l0: Array, l0_dot: Array, segments: Array, ends: Array, first: Array,
    room: Array, wrenches: Array, drums: Array,
) -> int:  # fmt: skip
    """Adds the wrenches of straight cables, over pulleys and eyelets or none.

    Args:
        motion: Motions of the bodies, shape (n, 18), see `tree_kernel.tree_motion`.
        l0: Unstrained lengths, shape (m,) [m].
        l0_dot: Their rates, shape (m,) [m/s].
        segments: From `CableRoutes.packed`, shape (s, 17).
        ends: From there, shape (s, 2).
        first: From there, shape (m + 1,).
        room: From `make_route_room`.
        wrenches: Moments about Bo and forces in W, shape (n, 6) [N m, N].
        drums: Where the tensions at the exit points are written, shape (m,) or (0,) [N].

    Returns:
        Index of the first cable that cannot run so, or -1.
    """
    _, lines, _, _, _ = _parts(room, segments.shape[0])
    bad = -1
    for i in range(first.shape[0] - 1):
        k, end = first[i], first[i + 1]
        if end == k + 1:
            e, b = ends[k, 0], ends[k, 1]
            px, py, pz, _, t_A, _, _, _, rx, ry, rz, good = straight_motion(
                _seen(motion, e, b), segments[k], l0[i], l0_dot[i]
            )
            if e != b:
                p, r = (px, py, pz), (rx, ry, rz)
                _add_pull(motion, e, b, p, r, e != 0, 0.0, segments[k], wrenches)
        else:
            _write_lines(motion, segments[k:end], ends[k:end], lines[k:end])
            t_A, _ = _tension_through(
                motion, segments[k], ends[k:end], lines[k:end], l0[i], l0_dot[i]
            )
            good = t_A == t_A
            for j in range(k, end):
                e, b = ends[j, 0], ends[j, 1]
                if e == b:
                    continue
                ux, uy, uz = lines[j, 1], lines[j, 2], lines[j, 3]
                good = good and ux == ux
                p, r = (t_A * ux, t_A * uy, t_A * uz), (lines[j, 4], lines[j, 5], lines[j, 6])
                _add_pull(motion, e, b, p, r, e != 0, 0.0, segments[j], wrenches)
        if not good and bad < 0:
            bad = i
        if drums.shape[0] > 0:
            drums[i] = t_A
    return bad


@njit(cache=True)
def add_any_wrenches(
    motion: Array, l0: Array, l0_dot: Array, segments: Array, ends: Array, first: Array,
    room: Array, wrenches: Array, drums: Array,
) -> int:  # fmt: skip
    """As `add_straight_wrenches` for either law; cables that sag have no eyelets."""
    guesses, _, row, inner, D = _parts(room, segments.shape[0])
    bad = -1
    for i in range(first.shape[0] - 1):
        k = first[i]
        if first[i + 1] != k + 1 or not segments[k, LINEAR_WEIGHT] > 0.0:
            one = first[i : i + 2]
            wrong = add_straight_wrenches(
                motion, l0[i : i + 1], l0_dot[i : i + 1], segments, ends, one, room, wrenches,
                drums[i : i + 1],
            )  # fmt: skip
            if wrong >= 0 and bad < 0:
                bad = i
            continue
        e, b = ends[k, 0], ends[k, 1]
        px, py, pz, _, t_A, _, _, _, rx, ry, rz, good = _hanging(
            motion, segments[k], e, b, l0[i], l0_dot[i], guesses[k], row, inner, D
        )
        if not good and bad < 0:
            bad = i
        if drums.shape[0] > 0:
            drums[i] = t_A
        weight = segments[k, LINEAR_WEIGHT] * l0[i]
        p, r = (px, py, pz), (rx, ry, rz)
        _add_pull(motion, e, b, p, r, False, weight, segments[k], wrenches)
    return bad


@njit(cache=True)
def add_plain_wrenches(
    motion: Array, l0: Array, l0_dot: Array, segments: Array, ends: Array, first: Array,
    room: Array, wrenches: Array, drums: Array,
) -> int:  # fmt: skip
    """As `add_straight_wrenches` without pulleys and eyelets, as `CableForces` computes it."""
    if drums.shape[0] > 0 or room[_PLAIN] == 0.0:
        return add_straight_wrenches(
            motion, l0, l0_dot, segments, ends, first, room, wrenches, drums
        )
    _plain_wrenches(motion, l0, l0_dot, segments, ends, wrenches)
    return -1


@njit(cache=True)
def straight_route_outputs(
    motion: Array, l0: Array, l0_dot: Array, segments: Array, ends: Array, first: Array,
    room: Array, out: Array,
) -> int:  # fmt: skip
    """Writes what straight cables do, shape (6, m), rows as `simulation_kernel.OUTPUTS`.

    Arguments as `add_straight_wrenches`.

    Returns:
        Index of the first cable that cannot run so, or -1.
    """
    _, lines, _, _, _ = _parts(room, segments.shape[0])
    bad = -1
    for i in range(first.shape[0] - 1):
        k, end = first[i], first[i + 1]
        if end == k + 1:
            _, _, _, t, t_A, length, surplus, sag, _, _, _, good = straight_motion(
                _seen(motion, ends[k, 0], ends[k, 1]), segments[k], l0[i], l0_dot[i]
            )
        else:
            _write_lines(motion, segments[k:end], ends[k:end], lines[k:end])
            t, length = _tension_through(
                motion, segments[k], ends[k:end], lines[k:end], l0[i], l0_dot[i]
            )
            t_A, surplus, sag = t, max(l0[i] - length, 0.0 * length), 0.0 * length
            good = length == length
        if not good and bad < 0:
            bad = i
        write_outputs(out, i, t, t_A, length, surplus, sag, 0.0 * t)
    return bad


@njit(cache=True)
def any_route_outputs(
    motion: Array, l0: Array, l0_dot: Array, segments: Array, ends: Array, first: Array,
    room: Array, out: Array,
) -> int:  # fmt: skip
    """As `straight_route_outputs` for either law."""
    guesses, _, row, inner, D = _parts(room, segments.shape[0])
    bad = -1
    for i in range(first.shape[0] - 1):
        k = first[i]
        if first[i + 1] != k + 1 or not segments[k, LINEAR_WEIGHT] > 0.0:
            wrong = straight_route_outputs(
                motion, l0[i : i + 1], l0_dot[i : i + 1], segments, ends, first[i : i + 2], room,
                out[:, i : i + 1],
            )  # fmt: skip
            if wrong >= 0 and bad < 0:
                bad = i
            continue
        _, _, _, t, t_A, length, surplus, sag, _, _, _, good = _hanging(
            motion, segments[k], ends[k, 0], ends[k, 1], l0[i], l0_dot[i], guesses[k], row, inner, D
        )
        if not good and bad < 0:
            bad = i
        slack = slack_tension(HANGING, segments[k, LINEAR_WEIGHT], l0[i])
        write_outputs(out, i, t, t_A, length, surplus, sag, slack)
    return bad


@njit(cache=True)
def route_lengths(
    motion: Array, segments: Array, ends: Array, first: Array, room: Array, lengths: Array,
    wrenches: Array,
) -> int:  # fmt: skip
    """Writes lengths of straight cables, and the wrenches of a tension of 1 N in each.

    Args:
        motion: Motions of the bodies, shape (n, 18).
        segments: From `CableRoutes.packed`, shape (s, 17).
        ends: From there, shape (s, 2).
        first: From there, shape (m + 1,).
        room: From `make_route_room`.
        lengths: Where lengths are written, shape (m,) [m].
        wrenches: Where moments about Bo and forces in W are written, shape (m, n, 6) [m, -].

    Returns:
        Index of the first cable that cannot run so, or -1.
    """
    _, lines, _, _, _ = _parts(room, segments.shape[0])
    _write_lines(motion, segments, ends, lines)
    wrenches[:] = 0.0
    bad = -1
    for i in range(first.shape[0] - 1):
        lengths[i] = 0.0
        for k in range(first[i], first[i + 1]):
            e, b = ends[k, 0], ends[k, 1]
            lengths[i] = lengths[i] + lines[k, 0]
            p = (lines[k, 1], lines[k, 2], lines[k, 3])
            if np.isnan(p[0]) and bad < 0:
                bad = i
            if e != b:
                r = (lines[k, 4], lines[k, 5], lines[k, 6])
                _add_pull(motion, e, b, p, r, e != 0, 0.0, segments[k], wrenches[i])
    return bad


@njit(cache=True)
def _begin(tree: Array, state: Array, bodies: Array) -> Any:
    """Parts of the room of a tree: motions, wrenches, work; motions and no wrenches in them."""
    n = tree.shape[0]
    motion, wrenches = bodies[: 18 * n].reshape(n, 18), bodies[18 * n : 24 * n].reshape(n, 6)
    work = bodies[24 * n :]
    tree_motion(tree, state, work, motion)
    wrenches[:] = 0.0
    return motion, wrenches, work


def make_tree_room(tree: Array, dtype: Any = float) -> Array:
    """Room of the kernels below for the bodies of a tree."""
    return np.zeros(24 * len(tree) + TREE_WORK, dtype=dtype)


@njit(cache=True)
def straight_tree_force(
    tree: Array, state: Array, l0: Array, l0_dot: Array, segments: Array, ends: Array,
    first: Array, room: Array, bodies: Array, out: Array, drums: Array,
) -> int:  # fmt: skip
    """Writes the generalized force of straight cables on the bodies of a plant.

    Args:
        tree: From `models.PlantTree`, shape (n, 32).
        state: Positions and velocities of the plant, shape (nq + nv,).
        l0: See `add_straight_wrenches`, as all up to room.
        l0_dot: See there.
        segments: See there.
        ends: See there.
        first: See there.
        room: See there.
        bodies: From `make_tree_room`.
        out: Generalized force, shape (nv,) [N, N m].
        drums: Where the tensions at the exit points are written, shape (m,) or (0,) [N].

    Returns:
        Index of the first cable that cannot run so, or -1.
    """
    motion, wrenches, work = _begin(tree, state, bodies)
    bad = add_plain_wrenches(motion, l0, l0_dot, segments, ends, first, room, wrenches, drums)
    out[:] = 0.0
    add_tree_force(tree, state, motion, wrenches, work, out)
    return bad


@njit(cache=True)
def any_tree_force(
    tree: Array, state: Array, l0: Array, l0_dot: Array, segments: Array, ends: Array,
    first: Array, room: Array, bodies: Array, out: Array, drums: Array,
) -> int:  # fmt: skip
    """As `straight_tree_force` for either law."""
    motion, wrenches, work = _begin(tree, state, bodies)
    bad = add_any_wrenches(motion, l0, l0_dot, segments, ends, first, room, wrenches, drums)
    out[:] = 0.0
    add_tree_force(tree, state, motion, wrenches, work, out)
    return bad


@njit(cache=True)
def straight_tree_outputs(
    tree: Array, state: Array, l0: Array, l0_dot: Array, segments: Array, ends: Array,
    first: Array, room: Array, bodies: Array, out: Array,
) -> int:  # fmt: skip
    """Writes what straight cables do, shape (6, m); arguments as `straight_tree_force`."""
    motion, _, _ = _begin(tree, state, bodies)
    return straight_route_outputs(motion, l0, l0_dot, segments, ends, first, room, out)


@njit(cache=True)
def any_tree_outputs(
    tree: Array, state: Array, l0: Array, l0_dot: Array, segments: Array, ends: Array,
    first: Array, room: Array, bodies: Array, out: Array,
) -> int:  # fmt: skip
    """As `straight_tree_outputs` for either law."""
    motion, _, _ = _begin(tree, state, bodies)
    return any_route_outputs(motion, l0, l0_dot, segments, ends, first, room, out)


@njit(cache=True)
def route_energy(
    motion: Array, l0: Array, segments: Array, ends: Array, first: Array, room: Array
) -> float:
    """Potential energy of all cables by either law, of weight from z = 0 in W on [J].

    Arguments as `add_straight_wrenches`; cables that sag take the solutions that the kernels for
    either law left in the room for this motion.
    """
    guesses, lines, row, _, _ = _parts(room, segments.shape[0])
    energy = 0.0
    for i in range(first.shape[0] - 1):
        k, end = first[i], first[i + 1]
        weight = segments[k, LINEAR_WEIGHT] if room[_LAW] == HANGING and end == k + 1 else 0.0
        if weight > 0.0:
            E, a = motion[ends[k, 0]], segments[k]
            z = E[11] + E[6] * a[0] + E[7] * a[1] + E[8] * a[2]
            if ends[k, 0] == 0:
                X = motion_of_row(motion[ends[k, 1]])
                energy += cable_energy(HANGING, X, segments[k], l0[i], guesses[k])
            else:
                row[:] = segments[k]
                row[:3] = 0.0
                X = motion_from_point(E, motion[ends[k, 1]], segments[k, :3])
                energy += cable_energy(HANGING, X, row, l0[i], guesses[k])
            energy += weight * l0[i] * z
            continue
        _write_lines(motion, segments[k:end], ends[k:end], lines[k:end])
        stretch = np.sum(lines[k:end, 0]) - l0[i]
        if stretch > 0.0:
            energy += 0.5 * segments[k, 6] * stretch * stretch / l0[i]
    return energy


class RouteMemory:
    """Constants and room of the kernels below, handed over as one table of addresses.

    Eleven arrays cost more to hand over from Python than the forces of eight cables.
    """

    def __init__(
        self, tree: Array, packed: tuple[Array, np.ndarray, np.ndarray], cables: int, law: int
    ) -> None:
        """For a tree, what `CableRoutes.packed` gives, the number of cables and their law."""
        room, bodies = make_route_room(packed[0], cables, law), make_tree_room(tree)
        self.arrays = (tree, *packed, room, bodies)
        # Whole numbers are read along one axis.
        in_one_axis = [a if a.dtype == np.float64 else a.ravel() for a in self.arrays]
        self._kept = [np.ascontiguousarray(array) for array in in_one_axis]
        self.table = array_addresses(self._kept)


@njit(cache=True)
def straight_force_at(
    memory: Any, state: Array, l0: Array, l0_dot: Array, out: Array, drums: Array
) -> int:
    """`straight_tree_force` with its constants from a `RouteMemory.table`."""
    return straight_tree_force(
        matrix_at(memory, 0), state, l0, l0_dot, matrix_at(memory, 1),
        integers_at(memory, 2).reshape(-1, 2), integers_at(memory, 3), vector_at(memory, 4),
        vector_at(memory, 5), out, drums,
    )  # fmt: skip


@njit(cache=True)
def any_force_at(
    memory: Any, state: Array, l0: Array, l0_dot: Array, out: Array, drums: Array
) -> int:
    """`any_tree_force` with its constants from a `RouteMemory.table`."""
    return any_tree_force(
        matrix_at(memory, 0), state, l0, l0_dot, matrix_at(memory, 1),
        integers_at(memory, 2).reshape(-1, 2), integers_at(memory, 3), vector_at(memory, 4),
        vector_at(memory, 5), out, drums,
    )  # fmt: skip
