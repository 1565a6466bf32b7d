"""Robots as identifications see them, and robot files of what was found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cdpr_drake.analyses.calibration.log_fit import fitted_robot
from cdpr_drake.errors import IdentificationError
from cdpr_drake.identification.parameters import DynamicModel
from cdpr_drake.identification.regressor import central_parameters
from cdpr_drake.identification.result import IdentificationResult
from cdpr_drake.models.materials import OwnMaterial
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


def identified_robot(robot: Robot, result: IdentificationResult) -> tuple[Robot, tuple[str, ...]]:
    """A robot with what was found, and in words what its file has no place for."""
    model, left = result.model, []
    platform = replace(
        robot.platform, mass=model.mass, center_of_mass=np.array(model.center_of_mass),
        inertia=np.array(model.inertia),
    )  # fmt: skip
    cables, winch = list(robot.cables), robot.winch
    changed = {
        "stiffness": any(name.endswith(".stiffness") for name in result.names),
        "retardation_time": any(name.endswith(".retardation_time") for name in result.names),
    }
    if any(changed.values()):
        for k, (cable, material) in enumerate(zip(robot.cables, robot.materials(), strict=True)):
            own = cable.material or OwnMaterial()
            area = 0.25 * np.pi * material.diameter**2
            if changed["stiffness"]:
                own = replace(own, youngs_modulus=float(model.stiffness[k] / area))
            if changed["retardation_time"]:
                own = replace(own, retardation_time=float(model.retardation[k]))
            cables[k] = replace(cable, material=own)
        left.append("length offsets belong to the log; they are in identification.json")
    if any(name.endswith((".coulomb", ".static")) for name in result.names):
        if winch.friction is None:
            raise IdentificationError(
                f"robot {robot.name}: winch.friction: found null; accepted: a section, whose "
                "stribeck_speed says over which speed static fades to Coulomb friction"
            )
        means = {
            key: float(np.mean(getattr(model, key))) for key in ("coulomb", "static", "viscous")
        }
        winch = replace(winch, friction=replace(winch.friction, **means))
        if np.ptp(model.coulomb) > 0.0 or np.ptp(model.viscous) > 0.0:
            left.append(
                "friction: the file has one law for all winches, their mean; each is in "
                "identification.json"
            )
    changes = {"platform": platform, "cables": cables, "winch": winch}
    return fitted_robot(robot, "Identified", result, **changes), tuple(left)
