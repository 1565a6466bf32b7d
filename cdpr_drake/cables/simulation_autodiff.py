"""The cables of a simulation on arrays of any scalar, AutoDiffXd included."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd

from cdpr_drake.arrays import Array
from cdpr_drake.cables import route_kernel, simulation_kernel
from cdpr_drake.cables.behaving_kernel import creep_rates, put_crept
from cdpr_drake.cables.hanging_kernel import equations, solve_catenary
from cdpr_drake.cables.models import HANGING, STRAIGHT
from cdpr_drake.cables.route_kernel import make_route_room, make_tree_room
from cdpr_drake.cables.simulation_kernel import OUTPUTS, guesses_of, make_room
from cdpr_drake.geometry.two_pulleys_kernel import begin_swivels
from cdpr_drake.numerics.kernel_calls import any_scalar

_equations = any_scalar(equations)


def _value(x: Any) -> float:
    return float(x.value()) if isinstance(x, AutoDiffXd) else float(x)


def solve_catenary_any(*arguments: Any) -> Any:
    """`hanging_kernel.solve_catenary` for any scalar: solved by numbers, then one Newton step.

    The step, in the arguments' scalars and with the solved Jacobian, changes the solution by
    nothing and gives it the derivatives of the implicit function.
    """
    numbers = [_value(a) for a in arguments]
    H, V_A, good = solve_catenary(*numbers)
    if not good:
        return H, V_A, False
    _, _, xx, xz, zx, zz, _ = equations(H, V_A, *numbers[:7])
    nothing = 0.0 * arguments[0]  # of the arguments' scalar
    e_x, e_z, _, _, _, _, _ = _equations(H + nothing, V_A + nothing, *arguments[:7])
    det = xx * zz - xz * zx
    return H - (zz * e_x - xz * e_z) / det, V_A - (xx * e_z - zx * e_x) / det, True


def begin_swivels_any(*arguments: Any) -> Any:
    """`two_pulleys_kernel.begin_swivels` by numbers alone; the steps behind it differentiate."""
    numbers = [
        tuple(map(_value, each)) if isinstance(each, tuple) else _value(each) for each in arguments
    ]
    return begin_swivels(*numbers)


_SOLVED = {"solve_catenary": solve_catenary_any, "begin_swivels": begin_swivels_any}
"""What is solved by iterations: as numbers, and then differentiated."""

_force = any_scalar(simulation_kernel.model_force, _SOLVED)
_force_and_drums = any_scalar(simulation_kernel.model_force_and_drums, _SOLVED)
_outputs = any_scalar(simulation_kernel.model_outputs, _SOLVED)


def model_force_array(
    state: Any,
    l0: Any,
    l0_dot: Any,
    cables: Array,
    law: int,
    height: float,
    *,
    start: int,
    nv: int,
    crept: Any = None,
) -> tuple[Any, int]:
    """`simulation_kernel.model_force` for arrays of any scalar.

    Args:
        state: State of the platform, shape (13,) floating, (6,) planar or (2,) on a line.
        l0: Unstrained lengths, shape (m,) [m].
        l0_dot: Their rates, shape (m,) [m/s].
        cables: `CableSet.packed()`, shape (m, 17).
        law: Number of their law, see `CableModel`.
        height: Height of the plane of a planar joint [m].
        start: Where the platform's velocities begin among those of the plant.
        nv: Number of the plant's velocities.
        crept: What has crept of the cables, shape (m,); None: nothing.

    Returns:
        Generalized force, shape (nv,), dtype object, and the first cable that cannot run or -1.
    """
    out = np.zeros(nv, dtype=object)
    room = make_room(len(l0), law, height, start, dtype=object)
    _put_crept(room, crept)
    bad = _force(state, l0, l0_dot, cables, room, out)
    return out, bad


def model_outputs_array(
    state: Any,
    l0: Any,
    l0_dot: Any,
    cables: Array,
    law: int,
    height: float,
    *,
    crept: Any = None,
) -> tuple[Any, int]:
    """`simulation_kernel.model_outputs` for arrays of any scalar: shape (6, m), dtype object."""
    out = np.zeros((OUTPUTS, len(l0)), dtype=object)
    room = make_room(len(l0), law, height, dtype=object)
    _put_crept(room, crept)
    bad = _outputs(state, l0, l0_dot, cables, room, out)
    return out, bad


def creep_rates_array(
    state: Any, l0: Any, l0_dot: Any, cables: Array, law: int, height: float, *, crept: Any
) -> Any:
    """`behaving_kernel.creep_rates` for arrays of any scalar, shape (m,), dtype object."""
    out, rates = np.zeros((OUTPUTS, len(l0)), dtype=object), np.zeros(len(l0), dtype=object)
    room = make_room(len(l0), law, height, dtype=object)
    _put_crept(room, crept)
    _outputs(state, l0, l0_dot, cables, room, out)
    creep_rates.py_func(guesses_of.py_func(room, len(l0)), cables, rates)
    return rates


def _put_crept(room: Any, crept: Any) -> None:
    if crept is not None:
        put_crept.py_func(crept, guesses_of.py_func(room, len(crept)))


def model_force_and_drums_array(
    state: Any,
    l0: Any,
    l0_dot: Any,
    cables: Array,
    law: int,
    height: float,
    *,
    start: int,
    nv: int,
    crept: Any = None,
) -> tuple[Any, int]:
    """`simulation_kernel.model_force_and_drums` for arrays of any scalar, shape (nv + m,)."""
    out = np.zeros(nv + len(l0), dtype=object)
    room = make_room(len(l0), law, height, start, dtype=object)
    _put_crept(room, crept)
    bad = _force_and_drums(state, l0, l0_dot, cables, room, nv, out)
    return out, bad


_routes = {
    law: (any_scalar(force, _SOLVED), any_scalar(outputs, _SOLVED))
    for law, (force, outputs) in {
        STRAIGHT: (route_kernel.straight_tree_force, route_kernel.straight_tree_outputs),
        HANGING: (route_kernel.any_tree_force, route_kernel.any_tree_outputs),
    }.items()
}
"""Force and outputs of cables on the bodies of a plant, by law."""


def tree_force_array(
    tree: Array,
    state: Any,
    l0: Any,
    l0_dot: Any,
    routes: tuple[Array, Any, Any],
    *,
    law: int,
    nv: int,
) -> tuple[Any, Any, int]:
    """`route_kernel.any_tree_force` for arrays of any scalar.

    Args:
        tree: Table of the plant's joints, shape (n, 32).
        state: Positions and velocities of the plant, shape (nq + nv,).
        l0: Unstrained lengths, shape (m,) [m].
        l0_dot: Their rates, shape (m,) [m/s].
        routes: From `CableRoutes.packed`.
        law: Number of the cables' law, see `CableModel`.
        nv: Number of the plant's velocities.

    Returns:
        Generalized force, shape (nv,), tensions at the exit points, shape (m,), dtype object, and
        the first cable that cannot run or -1.
    """
    out, drums = np.zeros(nv, dtype=object), np.zeros(len(l0), dtype=object)
    room = make_route_room(routes[0], len(l0), law, dtype=object)
    bodies = make_tree_room(tree, dtype=object)
    bad = _routes[law][0](tree, state, l0, l0_dot, *routes, room, bodies, out, drums)
    return out, drums, bad


def tree_outputs_array(
    tree: Array, state: Any, l0: Any, l0_dot: Any, routes: tuple[Array, Any, Any], law: int
) -> tuple[Any, int]:
    """`route_kernel.any_tree_outputs` for arrays of any scalar: shape (6, m), dtype object."""
    out = np.zeros((OUTPUTS, len(l0)), dtype=object)
    room = make_route_room(routes[0], len(l0), law, dtype=object)
    bodies = make_tree_room(tree, dtype=object)
    bad = _routes[law][1](tree, state, l0, l0_dot, *routes, room, bodies, out)
    return out, bad


_on_bodies = {
    law: (any_scalar(wrenches, _SOLVED), any_scalar(outputs, _SOLVED))
    for law, (wrenches, outputs) in {
        STRAIGHT: (route_kernel.add_straight_wrenches, route_kernel.straight_route_outputs),
        HANGING: (route_kernel.add_any_wrenches, route_kernel.any_route_outputs),
    }.items()
}
"""Wrenches and outputs of cables on bodies whose motions are given, by law."""


def route_wrenches_array(
    motion: Any, l0: Any, l0_dot: Any, routes: tuple[Array, Any, Any], law: int
) -> tuple[Any, int]:
    """`route_kernel.add_any_wrenches` for arrays of any scalar.

    Args:
        motion: Motions of the bodies, shape (n, 18).
        l0: Unstrained lengths, shape (m,) [m].
        l0_dot: Their rates, shape (m,) [m/s].
        routes: From `CableRoutes.packed`.
        law: Number of the cables' law, see `CableModel`.

    Returns:
        Moments about Bo and forces in W, shape (n, 6), dtype object, and the first cable that
        cannot run or -1.
    """
    out = np.zeros((len(motion), 6), dtype=object)
    room = make_route_room(routes[0], len(l0), law, dtype=object)
    bad = _on_bodies[law][0](motion, l0, l0_dot, *routes, room, out, np.zeros(0, dtype=object))
    return out, bad


def route_outputs_array(
    motion: Any, l0: Any, l0_dot: Any, routes: tuple[Array, Any, Any], law: int
) -> tuple[Any, int]:
    """`route_kernel.any_route_outputs` for arrays of any scalar: shape (6, m), dtype object."""
    out = np.zeros((OUTPUTS, len(l0)), dtype=object)
    room = make_route_room(routes[0], len(l0), law, dtype=object)
    bad = _on_bodies[law][1](motion, l0, l0_dot, *routes, room, out)
    return out, bad
