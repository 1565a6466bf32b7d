"""Parameters of a robot by the names that calibrations and identifications give them.

`C1.exit_point.x` is a parameter of the cable C1, `all.stiffness` one of all cables, `mass` one of
the platform. `changed_robot` adds changes to them. What belongs to a log, such as the zeros of its
sensors, is no parameter of a robot's motion.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.cable_schema import Cable, OwnMaterial
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.typed_yaml import closest

_AXES, _SIX = "xyz", ("xx", "yy", "zz", "xy", "xz", "yz")

OF_A_LOG = (
    "*.length_offset", "*.swivel_offset", "tracker.*", "marker.*", "camera.*", "tag*.pose.*",
    "tilt_zero.*", "clock", "common_length_offset",
)  # fmt: skip
"""Names, with *, of what fits find that does not change how a robot moves."""

OF_A_CABLE = ("exit_point", "anchor_point", "pulley_radius", "drum_radius", "length_scale",
              "stiffness", "retardation_time")  # fmt: skip
OF_A_WINCH = ("coulomb", "static", "viscous")
"""Parameters of each cable, and of each winch's friction, of which a robot file has one for all:
changes of single winches change it by their mean."""

ALL = "all"
"""Owner of what all cables or winches share."""


def belongs_to_a_log(name: str) -> bool:
    """Whether a parameter is one of a log, not of the robot's motion."""
    return any(fnmatchcase(name, pattern) for pattern in OF_A_LOG)


def parameter_names(robot: Robot) -> tuple[str, ...]:
    """All that `changed_robot` can change, by name."""
    names = ["mass", *(f"center_of_mass.{x}" for x in _AXES), *(f"inertia.{x}" for x in _SIX)]
    for owner in (ALL, *(cable.name for cable in robot.cables)):
        for what in OF_A_CABLE:
            if what in ("exit_point", "anchor_point"):
                names += [f"{owner}.{what}.{x}" for x in _AXES] if owner != ALL else []
            else:
                names.append(f"{owner}.{what}")
        if robot.winch.friction is not None:
            names += [f"{owner}.{what}" for what in OF_A_WINCH]
    return (*names, "common_drum_radius", "common_length_scale")


def check_parameters(robot: Robot, names: tuple[str, ...]) -> None:
    """Checks that names are parameters of a robot, or of a log.

    Raises:
        RobotFileError: One is not.
    """
    known = parameter_names(robot)
    for name in names:
        if name not in known and not belongs_to_a_log(name):
            if name.rpartition(".")[2] in OF_A_WINCH and robot.winch.friction is None:
                raise RobotFileError(
                    f"robot {robot.name}: winch.friction: found null for the parameter {name}; "
                    "accepted: a section"
                )
            raise RobotFileError(f"parameter {name!r} of {robot.name}: {closest(name, known)}")


def changed_robot(robot: Robot, changes: Mapping[str, float]) -> Robot:
    """A robot some of whose parameters differ; the other one stays as it is.

    Args:
        robot: The robot.
        changes: What is added to parameters, by name, in SI units; of `length_scale` and
            `common_length_scale`, the drum's radius over what it was. Those of a log are left out.

    Raises:
        RobotFileError: A name is none of this robot's.
    """
    check_parameters(robot, tuple(changes))
    one = copy.copy(robot)
    one.platform = _platform(robot, changes)
    one.cables = [_cable(robot, k, cable, changes) for k, cable in enumerate(robot.cables)]
    friction = robot.winch.friction
    if friction is not None:
        moved = {
            what: getattr(friction, what) + _of_winches(robot, what, changes) for what in OF_A_WINCH
        }
        one.winch = replace(robot.winch, friction=replace(friction, **moved))
    return one


def _platform(robot: Robot, changes: Mapping[str, float]) -> Any:
    platform = replace(robot.platform, mass=robot.platform.mass + changes.get("mass", 0.0))
    shift = np.array([changes.get(f"center_of_mass.{x}", 0.0) for x in _AXES])
    if np.any(shift):
        platform.center_of_mass = robot.center_of_mass() + shift
    growth = np.array([changes.get(f"inertia.{x}", 0.0) for x in _SIX])
    if np.any(growth):
        inertia = platform.inertia
        if inertia is None:
            own = platform_inertia(robot)
            I = own.Shift(own.get_com()).CalcRotationalInertia()  # noqa: E741
            inertia = np.concatenate([I.get_moments(), I.get_products()])
        platform.inertia = inertia + growth
    return platform


def _cable(robot: Robot, index: int, cable: Cable, changes: Mapping[str, float]) -> Cable:
    def of(what: str) -> float:
        return changes.get(f"{cable.name}.{what}", 0.0) + changes.get(f"{ALL}.{what}", 0.0)

    def point(what: str) -> Any:
        return np.array([of(f"{what}.{x}") for x in _AXES])

    one = replace(
        cable,
        exit_point=cable.exit_point + point("exit_point"),
        anchor_point=cable.anchor_point + point("anchor_point"),
    )
    if of("pulley_radius"):
        own = cable.pulley_radius
        one.pulley_radius = (robot.pulley.radius if own is None else own) + of("pulley_radius")
    wider = of("drum_radius") + changes.get("common_drum_radius", 0.0)
    stretch = (1.0 + of("length_scale")) * (1.0 + changes.get("common_length_scale", 0.0))
    if wider or stretch != 1.0:
        own = robot.winch.drum_radius if cable.drum_radius is None else cable.drum_radius
        one.drum_radius = own * stretch + wider
    if of("stiffness") or of("retardation_time"):
        material, own_one = robot.materials()[index], cable.material or OwnMaterial()
        area = 0.25 * np.pi * material.diameter**2
        one.material = replace(
            own_one,
            youngs_modulus=material.youngs_modulus + of("stiffness") / area,
            retardation_time=material.retardation_time + of("retardation_time"),
        )
    return one


def _of_winches(robot: Robot, what: str, changes: Mapping[str, float]) -> float:
    own = [changes.get(f"{cable.name}.{what}", 0.0) for cable in robot.cables]
    return float(np.mean(own)) + changes.get(f"{ALL}.{what}", 0.0)


def impossible_parameter(robot: Robot) -> str:
    """What of a robot no robot can have, of all that `changed_robot` changes; empty: nothing."""
    platform, friction = robot.platform, robot.winch.friction
    below: list[tuple[str, Callable[[], bool]]] = [
        ("mass", lambda: not platform.mass > 0.0),
        ("inertia", lambda: not platform.has_possible_inertia()),
    ]
    if friction is not None:
        below += [
            ("coulomb", lambda: not friction.coulomb >= 0.0),
            ("viscous", lambda: not friction.viscous >= 0.0),
            ("static", lambda: not friction.static >= friction.coulomb),
        ]
    for name, fails in below:
        if fails():
            return name
    for cable, material in zip(robot.cables, robot.materials(), strict=True):
        if not material.youngs_modulus > 0.0:
            return f"{cable.name}.stiffness"
        if not 0.0 <= material.retardation_time <= 1.0:
            return f"{cable.name}.retardation_time"
        if cable.pulley_radius is not None and not cable.pulley_radius >= 0.0:
            return f"{cable.name}.pulley_radius"
        if cable.drum_radius is not None and not cable.drum_radius > 0.0:
            return f"{cable.name}.drum_radius"
    return ""
