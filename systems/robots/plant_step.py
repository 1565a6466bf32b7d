"""Which time step of a discrete plant its cables bear.

The forces of cables reach a discrete plant through its input ports, so that they are those of the
step's beginning: a step that is long against the vibrations on the cables throws the platform off.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.math import RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context
from pydrake.systems.primitives import MatrixGain

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableModelError
from cdpr_drake.geometry.poses import rotation_vector
from cdpr_drake.models.robot_in_plant import RobotInPlant
from cdpr_drake.numerics.explicit_integration import largest_discrete_step

CablePull = Callable[[Context], Array]
"""Generalized force of cables and dampers, shape (nv,), at a context of the plant."""

NEAR = 0.8
"""Share of the largest stable step from which on a step is warned of."""

TAUT = 1e-4
"""Strain of cables whose stiffness is asked for before anything is known of their tensions."""

_MOVE = 1e-7
"""Displacement of central differences [m, rad], and velocity [m/s, rad/s]: far less than cables
stretch, and far more than rounding."""


_LOG = logging.getLogger(__name__)


def stable_plant_step(plant: MultibodyPlant, context: Context, pull: CablePull) -> float:
    """Largest time step with which a discrete plant stays at rest on its cables [s].

    Args:
        plant: The plant, finalized.
        context: Of the plant; its positions are where the plant rests.
        pull: The cables with the unstrained lengths that they have there.
    """
    own, nv = plant.CreateDefaultContext(), plant.num_velocities()
    own.SetTimeStateAndParametersFrom(context)
    q, still = plant.GetPositions(own).copy(), np.zeros(nv)
    plant.SetVelocities(own, still)
    M = plant.CalcMassMatrix(own)
    K, D = np.zeros((nv, nv)), np.zeros((nv, nv))

    def at(positions: Array, velocities: Array) -> Array:
        plant.SetPositions(own, positions)
        plant.SetVelocities(own, velocities)
        return np.array(pull(own))

    for k in range(nv):
        step = np.zeros(nv)
        step[k] = _MOVE
        plant.SetPositions(own, q)
        way = np.asarray(plant.MapVelocityToQDot(own, step))
        K[:, k] = (at(q - way, still) - at(q + way, still)) / (2.0 * _MOVE)
        D[:, k] = (at(q, -step) - at(q, step)) / (2.0 * _MOVE)
    return largest_discrete_step(M, K, D)


def check_plant_step(plant: MultibodyPlant, context: Context, pull: CablePull, what: str) -> None:
    """Checks that a plant's time step is one with which it rests on its cables.

    A step above `NEAR` of the largest one is a warning in the log.

    Args:
        plant: The plant, finalized; a continuous one is not asked.
        context: As for `stable_plant_step`.
        pull: As for `stable_plant_step`.
        what: Whose cables, for the message.

    Raises:
        CableModelError: The step is longer; names the largest one.
    """
    step = plant.time_step()
    if step == 0.0:
        return
    largest = stable_plant_step(plant, context, pull)
    if step <= NEAR * largest:
        return
    if math.isfinite(largest):
        digits = 10.0 ** (2 - math.floor(math.log10(largest)))
        largest = math.floor(largest * digits) / digits  # never more than what is stable
    found = f"time_step of the plant of {what}: found {step:g} s; "
    if step > largest:
        raise CableModelError(
            found + f"accepted: up to {largest:g} s, above which the vibrations on its cables grow "
            "from step to step, or 0, a continuous plant"
        )
    _LOG.warning(
        "%sthe vibrations on its cables grow from %g s on, or from less where cables get shorter; "
        "up to %.3g s are safe",
        found, largest, NEAR * largest,
    )  # fmt: skip


def platform_pull(
    in_plant: RobotInPlant, forces: Any, lengths: Array, damping: MatrixGain | None
) -> CablePull:
    """Pull of a `CableForces` on a platform, and what brakes or holds the platform beside it.

    Args:
        in_plant: The platform in its plant.
        forces: Its cables.
        lengths: Their unstrained lengths, shape (m,) [m].
        damping: Of the platform's state, see `DampingSettings.block`.
    """
    plant, instance, own = in_plant.plant, in_plant.model_instance, forces.CreateDefaultContext()
    forces.GetInputPort("unstrained_lengths").FixValue(own, lengths)
    forces.GetInputPort("unstrained_length_rates").FixValue(own, np.zeros(len(lengths)))
    state, force = forces.GetInputPort("platform_state"), forces.GetOutputPort("generalized_force")
    contacts, joint = in_plant.robot.contact_hysteresis(), in_plant.robot.joint()
    start: RotationMatrix | None = None

    def pull(context: Context) -> Array:
        nonlocal start
        now = plant.GetPositionsAndVelocities(context, instance)
        state.FixValue(own, now)
        total = np.array(force.Eval(own))
        if damping is not None:
            total = total + damping.D() @ now
        if contacts is not None:  # that stick
            R = in_plant.pose(context).rotation()
            start = R if start is None else start
            moment = contacts.stiffness_in_world(R.matrix()) @ rotation_vector(R @ start.inverse())
            push = joint.wrench_map() @ np.concatenate([-moment, np.zeros(3)])
            total[in_plant.first_velocity() :][: len(push)] += push
        return total

    return pull


def check_platform_step(
    in_plant: RobotInPlant,
    plant_context: Context,
    forces: Any,
    lengths: Array,
    damping: MatrixGain | None,
) -> None:
    """As `check_plant_step`, of the cables of one platform, see `platform_pull`."""
    if in_plant.plant.time_step() == 0.0:
        return
    pull = platform_pull(in_plant, forces, lengths, damping)
    check_plant_step(in_plant.plant, plant_context, pull, in_plant.robot.name)
