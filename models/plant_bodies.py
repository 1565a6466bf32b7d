"""Masses, inertias, damping and rotors of a MultibodyPlant as arrays for compiled kernels."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, JointActuatorIndex, JointIndex

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableModelError
from cdpr_drake.models.plant_tree import PlantTree, unknown_joint

MASS, COM, INERTIA = slice(0, 1), slice(1, 4), slice(4, 10)
"""Columns of `body_inertias`."""


def whole_tree(plant: MultibodyPlant) -> PlantTree:
    """The tree of all bodies of a finalized plant, for `dynamics.tree_step_kernel`.

    Raises:
        CableModelError: The plant has what the compiled engine does not know, named: joints of
            another kind, force elements beside gravity, constraints, or a discrete step.
    """
    every = range(1, plant.num_bodies())
    problem = unknown_joint(plant, every, "the compiled engine") or _unknown_forces(plant)
    if problem:
        raise CableModelError(problem)
    return PlantTree.of(plant, every)


def _unknown_forces(plant: MultibodyPlant) -> str:
    if plant.num_force_elements() > 1:  # the first one is gravity
        return (
            f"force elements: found {plant.num_force_elements() - 1} beside gravity, such as "
            "springs; accepted by the compiled engine: none"
        )
    if plant.num_constraints():
        return (
            f"constraints: found {plant.num_constraints()}; accepted by the compiled engine: none"
        )
    if plant.time_step() > 0.0:
        return (
            f"time_step: found {plant.time_step():g} s; accepted by the compiled engine: 0, a "
            "continuous plant"
        )
    return ""


def body_inertias(plant: MultibodyPlant, tree: PlantTree) -> Array:
    """Mass, centre of mass and inertia of the bodies of a tree, shape (n, 10).

    See `tree_dynamics_kernel.INERTIA`: [kg], in B [m], about it in B [kg m^2].
    """
    context, out = plant.CreateDefaultContext(), np.zeros((len(tree.table), 10))
    for body, row in tree.rows.items():
        if row == 0:
            continue
        M = plant.get_body(BodyIndex(body)).CalcSpatialInertiaInBodyFrame(context)
        out[row, 0], out[row, COM] = M.get_mass(), M.get_com()
        about = M.Shift(M.get_com()).CalcRotationalInertia().CopyToFullMatrix3()
        out[row, INERTIA] = [
            about[0, 0], about[1, 1], about[2, 2], about[0, 1], about[0, 2], about[1, 2]
        ]  # fmt: skip
    return out


def joint_damping(plant: MultibodyPlant) -> Array:
    """Viscous damping by velocity, shape (nv,) [N s/m, N m s/rad]."""
    out = np.zeros(plant.num_velocities())
    for i in plant.GetJointIndices():
        joint = plant.get_joint(JointIndex(i))
        start, count = joint.velocity_start(), joint.num_velocities()
        if count:
            out[start : start + count] = joint.default_damping_vector()
    return out


def rotor_inertias(plant: MultibodyPlant) -> Array:
    """Inertia of actuators as their joints feel it, shape (nv,) [kg, kg m^2]."""
    out, context = np.zeros(plant.num_velocities()), plant.CreateDefaultContext()
    for i in plant.GetJointActuatorIndices():
        actuator = plant.get_joint_actuator(JointActuatorIndex(i))
        start = actuator.joint().velocity_start()
        out[start] += actuator.calc_reflected_inertia(context)
    return out
