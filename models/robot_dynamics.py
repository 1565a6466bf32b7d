"""The dynamics of robots as an identification has them."""

from __future__ import annotations

import numpy as np

from cdpr_drake.errors import IdentificationError
from cdpr_drake.identification.parameters import DynamicModel
from cdpr_drake.identification.regressor import central_parameters
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.winches.friction import FrictionLaw


def dynamic_model(robot: Robot) -> DynamicModel:
    """The dynamics of a robot as its file says.

    Raises:
        IdentificationError: Its platform does not move freely in space.
    """
    if not robot.motion_type().is_free:
        raise IdentificationError(
            f"robot {robot.name}: motion: found {robot.motion}; accepted by an identification: 3R3T"
        )
    platform = rigid_platform(robot)
    I_PPo = platform.I_PPo
    six = np.array([*np.diag(I_PPo), I_PPo[0, 1], I_PPo[0, 2], I_PPo[1, 2]])
    pi = np.concatenate([[platform.mass], platform.mass * platform.p_PCo, six])
    mass, center, inertia = central_parameters(pi)
    m = len(robot.cables)
    friction = FrictionLaw() if robot.winch.friction is None else robot.winch.friction.law()
    cables = robot.cable_set()
    return DynamicModel(
        names=tuple(cable.name for cable in robot.cables), mass=float(mass), center_of_mass=center,
        inertia=inertia, stiffness=cables.stiffness, retardation=cables.retardation,
        coulomb=np.full(m, friction.coulomb), static=np.full(m, friction.static),
        viscous=np.full(m, friction.viscous), stribeck_speed=friction.stribeck_speed,
        offset=np.zeros(m),
    )  # fmt: skip


def platform_size(robot: Robot) -> float:
    """Root mean square of the anchor points' distances from Po [m]."""
    p_PB = robot.cable_set().p_PB
    return float(np.sqrt(np.mean(np.sum(p_PB**2, axis=0)))) or 0.1
