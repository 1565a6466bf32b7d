"""What some robot can have: bounds on the unknown vector, and the program that keeps them."""

from __future__ import annotations

import numpy as np
from pydrake.solvers import LinearMatrixInequalityConstraint, MathematicalProgram
from pydrake.symbolic import Variable

from cdpr_drake.arrays import Array
from cdpr_drake.identification.parameters import (
    COMPLIANCE,
    COULOMB,
    DAMPING,
    EXCESS,
    FRICTION,
    LAG,
    PER_CABLE,
    PLATFORM,
    STATIC,
    STIFFNESS,
    VISCOUS,
    Layout,
    column,
)
from cdpr_drake.identification.regressor import SIZE, pseudo_inertia
from cdpr_drake.numerics.program_functions import ValueFunction

LEAST_INERTIA = 1e-9
"""Smallest eigenvalue of the pseudo-inertia that counts as inside of what bodies can have, over its
largest."""


def make_program(
    layout: Layout, cost: tuple[Array, Array, float], known: tuple[Array, Array]
) -> MathematicalProgram:
    """A quadratic cost of the vector over its typical sizes, over all that robots can have.

    Args:
        layout: The unknown vector.
        cost: H, g, c of (x' H x - 2 g' x + c) / 2.
        known: E, e of E x = e.
    """
    (H, g, c), (E, e), program = cost, known, MathematicalProgram()
    x = np.array([Variable(name) for name in _vector_names(layout)], dtype=object)
    program.AddDecisionVariables(x)
    program.AddQuadraticCost(H, -g, 0.5 * c, x, is_convex=True)
    if len(e):
        program.AddLinearEqualityConstraint(E, e, x)
    if any(group in PLATFORM for group in layout.unknown):
        F = [np.zeros((4, 4))]
        for k in range(SIZE):
            one = np.zeros(SIZE)
            one[k] = 1.0
            F.append(_squeezed(layout, pseudo_inertia(one * layout.typical[:SIZE])))
        program.AddLinearMatrixInequalityConstraint(F, x[:SIZE])
    for k in _not_negative(layout):
        program.AddBoundingBoxConstraint(0.0, np.inf, x[k])
    return program


def smooth_program(layout: Layout, program: MathematicalProgram) -> MathematicalProgram:
    """The same program for solvers that know no matrix inequality.

    All leading minors of the pseudo-inertia are positive in its place (Sylvester).
    """
    smooth = MathematicalProgram()
    x = program.decision_variables()
    smooth.AddDecisionVariables(x)
    for binding in program.GetAllCosts():
        smooth.AddCost(binding)
    for binding in program.GetAllConstraints():
        if not isinstance(binding.evaluator(), LinearMatrixInequalityConstraint):
            smooth.AddConstraint(binding)
            continue

        def minors(theta: Array) -> Array:
            J = _squeezed(layout, pseudo_inertia(theta))
            return np.array([np.linalg.det(J[:k, :k]) for k in range(1, 5)])

        scale, most = np.diag(layout.typical[:SIZE]), np.full(4, np.inf)
        made = ValueFunction(minors, scale, np.zeros(SIZE))
        smooth.AddConstraint(made, np.full(4, LEAST_INERTIA), most, vars=x[:SIZE])
    return smooth


def violated(layout: Layout, theta: Array) -> tuple[str, ...]:
    """What no robot has of a vector, in words."""
    words = []
    if any(group in PLATFORM for group in layout.unknown):
        values = np.linalg.eigvalsh(_squeezed(layout, pseudo_inertia(theta[:SIZE])))
        if values[0] < LEAST_INERTIA * values[-1]:
            words.append("mass and inertia: no body has them (pseudo-inertia not positive)")
    names = _vector_names(layout)
    words += [f"{names[k]}: below 0" for k in _not_negative(layout) if theta[k] < 0.0]
    return tuple(words)


def _squeezed(layout: Layout, J: Array) -> Array:
    """The pseudo-inertia by masses and lengths of order one, so that solvers see its rim."""
    scale = np.array([1.0 / layout.size] * 3 + [1.0]) / np.sqrt(layout.model.mass)
    return np.asarray(J * np.outer(scale, scale))


def _not_negative(layout: Layout) -> list[int]:
    free = layout.unknown
    what = [COMPLIANCE] * (STIFFNESS in free) + [LAG] * (DAMPING in free)
    what += [COULOMB, VISCOUS] * (FRICTION in free) + [EXCESS] * (STATIC in free)
    return [column(i, k) for i in range(len(layout.model.names)) for k in what]


def _vector_names(layout: Layout) -> list[str]:
    names = ["mass", "moment_x", "moment_y", "moment_z"]
    names += [f"inertia_{ab}" for ab in ("xx", "yy", "zz", "xy", "xz", "yz")]
    per = ("compliance", "lag", "offset", "coulomb", "excess", "viscous")
    assert len(per) == PER_CABLE
    assert len(names) == SIZE
    return names + [f"{cable}_{one}" for cable in layout.model.names for one in per]
