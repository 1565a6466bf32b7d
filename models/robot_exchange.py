"""Robots in and out of the files of other tools."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError, RobotFileError
from cdpr_drake.geometry import cable_lengths
from cdpr_drake.models.formats import (
    CompletedDraft,
    DraftCable,
    RobotDraft,
    complete_draft,
    read_foreign,
    write_caspr,
    write_gazebo_yaml,
    write_mjcf,
    write_sdformat,
    write_urdf,
    write_wirex,
)
from cdpr_drake.models.hardware import given_material
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import parse_robot
from cdpr_drake.models.robot_schema import Robot

EXPORTS = {
    "sdf": "SDFormat with chains of joints for cables, closed by ball joints, for Gazebo",
    "sdf-drake": "the same, closed by Drake's ball constraints, for Drake's parser",
    "urdf": "URDF of the platform with named frames for the points",
    "mjcf": "MJCF with spatial tendons, for MuJoCo",
    "wcrfx": "WireX and WireCenter",
    "caspr": "CASPR, two XML files",
    "gazebo-yaml": "the Gazebo cable robot simulator's YAML",
}
"""Formats that robots are written in, with what each is."""


@dataclass(frozen=True)
class ImportedRobot:
    """A robot from a file of another tool.

    Attributes:
        robot: The robot, checked.
        source: The file.
        tool: Its format, in words.
        completed: What the file gave and lacked, and the robot file as a mapping.
    """

    robot: Robot
    source: Path
    tool: str
    completed: CompletedDraft

    def yaml(self) -> str:
        """The robot file."""
        return self.completed.yaml()

    def readme(self) -> str:
        """What came from the file, what it lacked and what was assumed, as Markdown."""
        given = [f"- `{key}`" for key in self.completed.given]
        assumed = [f"| `{key}` | {words} |" for key, words in self.completed.assumed.items()]
        remarks = [f"- {words}" for words in self.completed.remarks] or ["- nothing"]
        return "\n".join(
            [
                f"# {self.robot.name}", "", f"Imported from `{self.source.name}` ({self.tool}).",
                "", "## From the file", "", *given, "", "## Assumed, for the file lacks it", "",
                "| key | value |", "| --- | --- |", *assumed, "", "## Read otherwise or not kept",
                "", *remarks, "",
            ]
        )  # fmt: skip


def import_robot(
    path: Path | str,
    *,
    name: str | None = None,
    model: str | None = None,
    cable_set: str | None = None,
) -> ImportedRobot:
    """Reads a robot from a file of another tool.

    Args:
        path: CASPR's XML, folder or list of models, WireX' wcrfx, the Gazebo simulator's YAML,
            GRAB's JSON, SDFormat, URDF or MJCF.
        name: Name of the robot; None: the file's.
        model: Name of a model in a CASPR list.
        cable_set: Set of cables of a CASPR model; None: its default one.

    Raises:
        RobotFileError: The file is not accepted; one line for each problem.
    """
    path = Path(path)
    draft = read_foreign(path, model, cable_set)
    if name is not None:
        draft.name = name
    completed = complete_draft(draft)
    return ImportedRobot(parse_robot(completed.yaml(), path), path, draft.tool, completed)


def draft_robot(robot: Robot) -> RobotDraft:
    """A robot as the writers of other formats take it."""
    lower, upper = robot.tension_limits()
    cables = robot.cable_set()
    com = robot.center_of_mass()
    inertia = platform_inertia(robot).Shift(com).CalcRotationalInertia()
    return RobotDraft(
        name=robot.name, tool="cdpr_drake", title=robot.title, motion=robot.motion,
        axis=robot.axis,
        cables=[
            DraftCable(
                name=cable.name, exit_point=cables.p_WA[:, k], anchor_point=cables.p_PB[:, k],
                lower=lower, upper=upper, pulley_radius=float(cables.pulley_radius[k]),
                swivel_axis=cables.swivel_axis[:, k],
                material=given_material(cable.material),
            )
            for k, cable in enumerate(robot.cables)
        ],
        mass=robot.platform.mass, center_of_mass=com,
        inertia=np.array([*inertia.get_moments(), *inertia.get_products()]),
        box_size=np.asarray(robot.platform.size, float), box_center=robot.box_center(),
        plane_height=robot.plane_height, home_position=np.asarray(robot.home.position, float),
        R_WP=robot.home.transform().rotation().matrix(), frame_lower=robot.frame.lower,
        frame_upper=robot.frame.upper, beam=robot.frame.beam_width(),
        diameter=robot.cable.diameter, youngs_modulus=robot.cable.youngs_modulus,
        linear_density=robot.cable.linear_density, breaking_load=robot.cable.breaking_load,
        drum_radius=robot.winch.drum_radius, gear_ratio=robot.winch.gear_ratio,
        motor_speed_rpm=robot.winch.motor_speed_rpm,
        cable_speed=robot.winch.rated_cable_speed(), motor_inertia=robot.winch.inertia,
        gravity=robot.gravity,
        gravity_direction=None
        if robot.down() == (0.0, 0.0, -1.0)
        else np.asarray(robot.gravity_direction, float),
    )  # fmt: skip


def not_written(robot: Robot, format: str) -> list[str]:
    """What a robot has of its own from cable to cable that a format cannot hold, a sentence each.

    Args:
        robot: The robot.
        format: A name of `EXPORTS`.
    """
    keys = {key for cable in robot.cables for key in given_material(cable.material)}
    if format == "mjcf":
        keys -= {"diameter", "youngs_modulus"}  # width and stiffness of a tendon
    lost = []
    if keys:
        lost.append(
            f"Cables differ in {', '.join(sorted(keys))}, which {format} has no place for: "
            "left out."
        )
    if robot.cable_set().has_platform_pulleys():
        lost.append(f"Pulleys at the platform, which {format} has no place for, were left out.")
    if robot.winch_groups().are_shared():
        lost.append(f"Several cables on one winch, for which {format} has no place: left out.")
    if robot.platform.shape is not None:
        lost.append("The platform's shape was written as its box.")
    if robot.frame.beams:
        lost.append("The frame was written as the box that Po stays in.")
    if any(cable.rail is not None for cable in robot.cables):
        lost.append("Rails: exit points were written where they stand.")
    return lost


def write_robot(robot: Robot, format: str) -> dict[str, str]:
    """Files of a robot in the format of another tool.

    Args:
        robot: The robot.
        format: A name of `EXPORTS`.

    Returns:
        Text of each file, by its name.

    Raises:
        RobotFileError: There is no such format, or it cannot hold this robot.
    """
    if format not in EXPORTS:
        raise RobotFileError(f"format: found {format}; accepted: {', '.join(EXPORTS)}")
    _check_held(robot, format)
    draft, name = draft_robot(robot), robot.name
    if format == "caspr":
        return {f"{name}_{part}.xml": text for part, text in write_caspr(draft).items()}
    if format == "wcrfx":
        return {f"{name}.wcrfx": write_wirex(draft)}
    if format == "mjcf":
        cables = robot.cable_set()
        return {f"{name}.xml": write_mjcf(draft, cables.stiffness, resting_lengths(robot))}
    if format == "gazebo-yaml":
        return {f"{name}.yaml": write_gazebo_yaml(draft)}
    if format == "urdf":
        return {f"{name}.urdf": write_urdf(draft)}
    return {f"{name}.sdf": write_sdformat(draft, for_drake=format == "sdf-drake")}


def _check_held(robot: Robot, format: str) -> None:
    """Refuses a motion type or a gravity that a format cannot hold."""
    motion, found = robot.motion_type(), robot.motion
    if robot.axis is not None:
        found += f" with axis {np.round(robot.axis, 6).tolist()}"
    accepted = ""
    if format == "caspr" and motion.rows is None:
        accepted = "types whose motions are along axes of W"
    elif format == "wcrfx" and (motion.num_moves < 3 and motion.axis != (0.0, 0.0, 1.0)):
        accepted = "types without an axis, or with it along z"
    elif format == "mjcf" and robot.motion == "2R3T":
        accepted = "all types but 2R3T"
    elif format not in ("caspr", "wcrfx", "mjcf") and not motion.is_free:
        accepted = "3R3T"
    if accepted:
        raise RobotFileError(
            f"robot {robot.name}: motion: found {found}; accepted for {format}: {accepted}"
        )
    if format != "mjcf" and robot.down() != (0.0, 0.0, -1.0):
        raise RobotFileError(
            f"robot {robot.name}: gravity_direction: found {robot.gravity_direction.tolist()}; "
            f"accepted for {format}: along -z of W"
        )


def resting_lengths(robot: Robot) -> Array:
    """Unstrained lengths of straight cables without pulleys that hold the robot at home [m].

    Shape (m,). Where no tensions within the limits hold it, those of cables without tension.
    """
    X_WP, cables = robot.home.transform(), robot.cable_set().without_pulleys()
    try:
        return np.asarray(hold_robot(robot, X_WP, cables, "elastic").unstrained_lengths)
    except CdprError:
        return cable_lengths(X_WP, cables.p_WA, cables.p_PB)
