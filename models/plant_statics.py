"""The statics of a plant on cables at its positions, as a tension problem."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BallRpyJoint,
    JointIndex,
    PlanarJoint,
    PrismaticJoint,
    QuaternionFloatingJoint,
)
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry.cable_routes import Integers
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import rows_of_joints, rows_of_motors
from cdpr_drake.tensions.problem import TensionProblem


def plant_tension_problem(
    cables: PlantCables,
    context: Context,
    force: Array | None = None,
    *,
    limits: tuple[Array | float, Array | float],
    held: Iterable[str] | None = None,
    reference: Array | None = None,
) -> TensionProblem:
    """Which tensions hold a plant at rest at its positions, where no motor does?

    W = -J_l' and w = tau_g + tau_a, on the rows that no motor holds.

    Args:
        cables: The cables of the plant.
        context: Of the plant.
        force: Generalized force without gravity and the plant's force elements, tau_a, shape (nv,)
            [N, N m]; None: none.
        limits: Smallest and largest tensions, shape (m,) or one for all [N].
        held: Joints that motors hold, by name; None: those with actuators in the plant.
        reference: Wanted tensions, shape (m,) [N].

    Raises:
        TensionProblemError: W is singular there, there are fewer cables than rows, or a number
            makes no sense.
        CableGeometryError: A cable cannot run there.
        EquilibriumError: There is no such joint.
    """
    plant, m = cables.plant, cables.routes.count
    motors = rows_of_motors(plant) if held is None else rows_of_joints(plant, held)
    rows = np.flatnonzero(~motors)
    if force is not None and np.shape(force) != (plant.num_velocities(),):
        raise TensionProblemError(
            f"force: found shape {np.shape(force)}; accepted: ({plant.num_velocities()},) [N, N m]"
        )
    W = -cables.length_jacobian(context).T[rows]
    wrench = cables.other_forces(context) + (0.0 if force is None else force)
    lower, upper = (np.broadcast_to(np.asarray(each, float), (m,)) for each in limits)
    scale = row_scale(plant, W, rows)
    return TensionProblem(W, wrench[rows], lower, upper, reference, scale)


def row_scale(plant: MultibodyPlant, W: Array, rows: Integers) -> Array:
    """What makes moments and forces of rows comparable [m, -].

    Rows of forces have 1, rows of moments the root mean square of the cables' arms about them.

    Args:
        plant: The plant.
        W: The rows of its wrench matrix, shape (n, m).
        rows: Which velocities they belong to, shape (n,).
    """
    moment = np.ones(plant.num_velocities(), dtype=bool)
    for joint in map(plant.get_joint, map(JointIndex, plant.GetJointIndices())):
        first, count = joint.velocity_start(), joint.num_velocities()
        if isinstance(joint, PrismaticJoint):
            moment[first] = False
        elif isinstance(joint, PlanarJoint):
            moment[first : first + 2] = False
        elif isinstance(joint, QuaternionFloatingJoint):
            moment[first + 3 : first + 6] = False
        elif not isinstance(joint, BallRpyJoint) and count == 6:
            moment[first + 3 : first + 6] = False  # another floating joint
    arms = np.sqrt(np.mean(W**2, axis=1)) if len(W) else np.zeros(0)
    return np.where(moment[rows] & (arms > 0.0), arms, 1.0)
