"""A platform at rest on its cables as a Drake MathematicalProgram: least potential energy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.math import RigidTransform
from pydrake.solvers import MathematicalProgram, SnoptSolver, SolverOptions

from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import CABLE_MODELS, STRAIGHT, cable_law, check_model
from cdpr_drake.errors import EquilibriumError
from cdpr_drake.geometry.cable_paths import cable_paths, motion_of
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_type import FREE
from cdpr_drake.geometry.poses import cross_matrix, rotation_from_vector
from cdpr_drake.statics.equilibrium_kernel import energy_at
from cdpr_drake.statics.rigid_platform import RigidPlatform

FEASIBILITY = 1e-9
"""What a solver may miss of a constraint [m], and of optimality, relative."""


@dataclass(frozen=True, eq=False)
class EquilibriumProgram:
    """A program and what its variables mean; add costs and constraints as you like.

    Attributes:
        program: Least potential energy, in weights times 1 m.
        displacement: Variables, shape (n,): turn about Po in W from the reference pose [rad], and
            translation [m]; components as `MotionType.basis` has them at the reference pose.
        stretches: Variables of elastic straight cables, shape (m,), in units of `unit` [m]; else
            empty.
        unit: What a weight stretches each cable by, shape (m,) [m].
        reference: The pose with displacement 0.
        platform: The platform.
    """

    program: MathematicalProgram
    displacement: np.ndarray
    stretches: np.ndarray
    unit: Array
    reference: RigidTransform
    platform: RigidPlatform

    def pose(self, displacement: Array) -> RigidTransform:
        """The pose of a displacement, shape (n,)."""
        return displaced(self.reference, self.platform, displacement)


def displaced(
    reference: RigidTransform, platform: RigidPlatform, displacement: Array
) -> RigidTransform:
    """A pose turned about Po in W and moved; displacement as in `EquilibriumProgram`."""
    six = platform.motion.twist(displacement, reference.rotation().matrix())
    return RigidTransform(
        rotation_from_vector(six[:3]) @ reference.rotation(), reference.translation() + six[3:]
    )


def make_equilibrium_program(
    cables: CableSet, model: str, platform: RigidPlatform, l0: Array, reference: RigidTransform
) -> EquilibriumProgram:
    """Least potential energy of platform and cables.

    With inextensible cables: the platform's, subject to lengths <= l0; the multipliers are the
    tensions. With straight elastic ones: also E S s^2 / (2 l0) of stretches s >= 0, subject to
    lengths - s <= l0. With sagging ones: the energy itself.

    Args:
        cables: The cables.
        model: A name of `cables.CABLE_MODELS`.
        platform: The platform, of positive weight.
        l0: Unstrained lengths, shape (m,) [m].
        reference: Pose that displacements are counted from.

    Raises:
        CableModelError: The model is unknown or cannot describe the cables.
        EquilibriumError: The platform has no weight, so that energies have no scale.
    """
    check_model(model, cables)
    weight = platform.mass * platform.gravity
    if not weight > 0.0:
        raise EquilibriumError("mass, gravity: found no weight; accepted: > 0 for a program")
    n, m = platform.motion.freedom, cables.count
    program = MathematicalProgram()
    x = program.NewContinuousVariables(n, "displacement")
    unit = weight * l0 / cables.stiffness
    none = np.zeros((0,), dtype=object)
    made = EquilibriumProgram(program, x, none, unit, reference, platform)

    kind = CABLE_MODELS[model]
    law = cable_law(model, cables)
    if law != STRAIGHT:
        packed, solved, g, H = cables.packed(), np.zeros((m, 2)), np.empty(6), np.empty((6, 6))

        def energy(values: Array) -> tuple[Array, Array]:
            X = made.pose(values)
            E, _, good = energy_at(
                law, motion_of(X), packed, l0, 1.0, platform.packed_weight(), FREE.packed(),
                solved, g, H,
            )  # fmt: skip
            if not good:
                return np.array([1e9]), np.zeros((1, n))
            return np.array([E]) / weight, (g / weight) @ _turning(made, values)[None]

        program.AddCost(lambda v: _evaluate(energy, v)[0], vars=x)
        return made

    def height(values: Array) -> tuple[Array, Array]:
        X = made.pose(values)
        slope = -platform.weight_wrench(X) / weight
        z = -np.asarray(platform.down) @ X.multiply(platform.p_PCo)
        return np.array([z]), slope[None] @ _turning(made, values)

    def lengths(values: Array) -> tuple[Array, Array]:
        paths = cable_paths(made.pose(values), cables)
        return paths.lengths, paths.J @ _turning(made, values)

    program.AddCost(lambda v: _evaluate(height, v)[0], vars=x)
    if not kind.extensible:
        program.AddConstraint(
            lambda v: _evaluate(lengths, v), lb=np.full(m, -np.inf), ub=l0, vars=x
        )
        return made
    s = program.NewContinuousVariables(m, "stretches")
    program.AddBoundingBoxConstraint(0.0, np.inf, s)
    program.AddQuadraticCost(np.diag(unit), np.zeros(m), s, is_convex=True)

    def excess(values: Array) -> tuple[Array, Array]:
        now, J = lengths(values[:n])
        return now - unit * values[n:], np.hstack([J, -np.diag(unit)])

    both = np.concatenate([x, s])
    program.AddConstraint(lambda v: _evaluate(excess, v), lb=np.full(m, -np.inf), ub=l0, vars=both)
    return EquilibriumProgram(program, x, s, unit, reference, platform)


def solve_equilibrium_program(made: EquilibriumProgram) -> RigidTransform:
    """The pose that SNOPT finds from the reference pose, as exact as its tolerances.

    Raises:
        EquilibriumError: SNOPT finds none.
    """
    options = SolverOptions()
    for name in ("Major feasibility tolerance", "Major optimality tolerance"):
        options.SetOption(SnoptSolver().id(), name, FEASIBILITY)
    guess = np.zeros(made.program.num_vars())
    result = SnoptSolver().Solve(made.program, guess, options)
    if not result.is_success():
        raise EquilibriumError(
            f"equilibrium: the program found none, {result.get_solution_result().name}"
        )
    return made.pose(result.GetSolution(made.displacement))


def _turning(made: EquilibriumProgram, displacement: Array) -> Array:
    """Twist in W about the displaced pose by the displacement, shape (6, n)."""
    motion, R = made.platform.motion, made.reference.rotation().matrix()
    T = np.eye(6)
    w = motion.twist(displacement, R)[:3]
    angle = float(np.linalg.norm(w))
    K = cross_matrix(w)
    if angle < 1e-4:
        a, b = 0.5 - angle**2 / 24.0, 1.0 / 6.0 - angle**2 / 120.0
    else:
        a, b = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    T[:3, :3] += a * K + b * K @ K
    return motion.columns(T, R)


def _evaluate(function: object, x: np.ndarray) -> np.ndarray:
    """Value and derivative of a function, as floats or with the derivatives that x carries."""
    assert callable(function)
    if x.dtype != object or not isinstance(x.flat[0], AutoDiffXd):
        return np.asarray(function(np.asarray(x, float))[0])
    value, slope = function(ExtractValue(x).ravel())
    return np.asarray(InitializeAutoDiff(value, slope @ ExtractGradient(x)).ravel())
