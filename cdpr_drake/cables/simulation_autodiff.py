"""The cables of a simulation on arrays of any scalar, AutoDiffXd included."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd

from cdpr_drake.arrays import Array
from cdpr_drake.cables import simulation_kernel
from cdpr_drake.cables.hanging_kernel import equations, solve_catenary
from cdpr_drake.cables.simulation_kernel import OUTPUTS, make_room
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

    Returns:
        Generalized force, shape (nv,), dtype object, and the first cable that cannot run or -1.
    """
    out = np.zeros(nv, dtype=object)
    room = make_room(len(l0), law, height, start, dtype=object)
    bad = _force(state, l0, l0_dot, cables, room, out)
    return out, bad


def model_outputs_array(
    state: Any, l0: Any, l0_dot: Any, cables: Array, law: int, height: float
) -> tuple[Any, int]:
    """`simulation_kernel.model_outputs` for arrays of any scalar: shape (6, m), dtype object."""
    out = np.zeros((OUTPUTS, len(l0)), dtype=object)
    room = make_room(len(l0), law, height, dtype=object)
    bad = _outputs(state, l0, l0_dot, cables, room, out)
    return out, bad


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
) -> tuple[Any, int]:
    """`simulation_kernel.model_force_and_drums` for arrays of any scalar, shape (nv + m,)."""
    out = np.zeros(nv + len(l0), dtype=object)
    room = make_room(len(l0), law, height, start, dtype=object)
    bad = _force_and_drums(state, l0, l0_dot, cables, room, nv, out)
    return out, bad
