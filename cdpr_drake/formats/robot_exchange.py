"""Robots in and out of the files of other tools."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import RobotFileError
from cdpr_drake.formats.assumptions import CompletedDraft, complete_draft, import_readme
from cdpr_drake.formats.caspr_writer import write_caspr
from cdpr_drake.formats.detection import read_foreign
from cdpr_drake.formats.draft import DraftCable, RobotDraft
from cdpr_drake.formats.drake_package import write_drake_package
from cdpr_drake.formats.gazebo_yaml import write_gazebo_yaml
from cdpr_drake.formats.joint_chains import write_sdformat, write_urdf
from cdpr_drake.formats.klipper import write_klipper
from cdpr_drake.formats.maslow import write_maslow
from cdpr_drake.formats.mjcf import write_mjcf
from cdpr_drake.formats.reprapfirmware import write_reprapfirmware
from cdpr_drake.formats.robot_exports import check_format, names_in_file, xml_words
from cdpr_drake.formats.wirex import write_wirex
from cdpr_drake.models.cable_schema import given_material
from cdpr_drake.models.file_kinds import is_foreign
from cdpr_drake.models.robot_copies import gravity_turn, turned_robot, world_turn
from cdpr_drake.models.robot_holding import lengths_at_home
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import as_robot, parse_robot, point_notes
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.summaries import Summarized


@dataclass(frozen=True, repr=False)
class ImportedRobot(Summarized):
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
        return import_readme(self.robot.name, self.source.name, self.tool, self.completed)

    def as_dict(self) -> dict[str, Any]:
        """What came from where, for JSON."""
        return {
            "robot": self.robot.name,
            "format": self.tool,
            "source": str(self.source),
            "motion": self.robot.motion,
            "cables": len(self.robot.cables),
            "given": list(self.completed.given),
            "assumed": self.completed.assumed,
            "remarks": list(self.completed.remarks),
        }

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """Title and rows of its table."""
        robot, made = self.robot, self.completed
        return f"Robot {robot.name} from {self.tool}", [
            ("source", str(self.source)),
            ("motion, cables", f"{robot.motion}, {len(robot.cables)}"),
            ("given", f"{len(made.given)} keys"),
            ("assumed", ", ".join(made.assumed) or "nothing"),
            *(("remark", words) for words in made.remarks[:4]),
        ]


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


class Deviations(NamedTuple):
    """Standard deviations of a cable that was fitted, NaN where something was not.

    Attributes:
        point: Of its exit point less its anchor point along each axis of W, shape (3,) [m].
        radius: Of its drum's radius [m].
    """

    point: Array
    radius: float


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
                material=given_material(cable.material), drum_radius=cable.drum_radius,
                mechanical_advantage=cable.mechanical_advantage,
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
        arm=robot.pulley.arm or None,
        drum_radius=robot.winch.drum_radius, gear_ratio=robot.winch.gear_ratio,
        layers=_layers(robot),
        motor_speed_rpm=robot.winch.motor_speed_rpm,
        cable_speed=robot.winch.rated_cable_speed(), motor_inertia=robot.winch.inertia,
        gravity=robot.gravity,
        gravity_direction=None
        if robot.down() == (0.0, 0.0, -1.0)
        else np.asarray(robot.gravity_direction, float),
    )  # fmt: skip


def _layers(robot: Robot) -> dict[str, float] | None:
    layers = robot.winch.layers
    if layers is None:
        return None
    height = robot.cable.diameter if layers.height is None else layers.height
    return {"turns": layers.turns, "height": height, "wound": layers.wound}


def export_robot(
    robot: Robot | str | Path, format: str, deviations: Sequence[Deviations] = ()
) -> dict[str, str]:
    """Files of a robot in the format of another tool.

    Args:
        robot: The robot, or its name or path.
        format: A name of `EXPORTS`.
        deviations: Of all cables, for comments in files of `FIRMWARES`; none in a turned world.

    Returns:
        Text of each file, by its name. In a turned world, as `world_turn` says, a comment at their
        top tells so.

    Raises:
        RobotFileError: There is no such format, or it cannot hold this robot. What it cannot hold
            of one that it takes, `export_omissions` says.
    """
    robot = as_robot(robot, "export_robot")
    check_format(format)
    turn, words = gravity_turn(robot), world_turn(robot, format)
    if turn is None or not words:
        return _written(robot, format, deviations)
    try:
        files = _written(turned_robot(robot, turn), format)
    except RobotFileError as problem:
        raise RobotFileError(f"{problem}, in the world that {words[10:]}") from problem
    return {name: with_comment(text, words) for name, text in files.items()}


def with_comment(text: str, words: str) -> str:
    """A file with a comment at its top, in XML below the line that says what it is."""
    if not text.startswith("<"):
        return f"{';' if text.startswith(';') else '#'} {words}\n{text}"
    head, line, body = text.partition("\n") if text.startswith(("<?", "<!")) else ("", "", text)
    return f"{head}{line}<!-- {words} -->\n{body}"


def _written(robot: Robot, format: str, deviations: Sequence[Deviations] = ()) -> dict[str, str]:
    """Files of a robot whose gravity the format can hold."""
    _check_held(robot, format)
    draft, name = draft_robot(robot), robot.name
    draft.title = xml_words(draft.title)
    for cable, word in zip(
        draft.cables, names_in_file([cable.name for cable in draft.cables], format), strict=True
    ):
        cable.name = word
    for cable, std in zip(draft.cables, deviations, strict=False):
        cable.point_std, cable.radius_std = std
    if format == "caspr":
        return {f"{name}_{part}.xml": text for part, text in write_caspr(draft).items()}
    if format == "wcrfx":
        return {f"{name}.wcrfx": write_wirex(draft)}
    if format == "mjcf":
        return {f"{name}.xml": write_mjcf(draft, robot.stiffness(), lengths_at_home(robot)[0])}
    if format == "gazebo-yaml":
        return {f"{name}.yaml": write_gazebo_yaml(draft)}
    if format == "klipper":
        return {f"{name}.cfg": write_klipper(draft)}
    if format == "reprapfirmware":
        return {f"{name}.g": write_reprapfirmware(draft)}
    if format == "maslow":
        return {f"{name}.yaml": write_maslow(draft)}
    if format == "urdf":
        return {f"{name}.urdf": write_urdf(draft)}
    if format == "drake":
        home = robot.home.transform()
        return write_drake_package(name, draft.title, write_urdf(draft), home)
    return {f"{name}.sdf": write_sdformat(draft, for_drake=format == "sdf-drake")}


FIRMWARES = {"klipper": ("3T", 3, 26), "reprapfirmware": ("3T", 3, 9), "maslow": ("2T", 4, 4)}
"""Motion types of firmwares, and how many cables they have."""


def _check_held(robot: Robot, format: str) -> None:
    """Refuses a motion type that a format cannot hold."""
    motion, found = robot.motion_type(), robot.motion
    if robot.axis is not None:
        found += f" with axis {np.round(robot.axis, 6).tolist()}"
    accepted, m = "", len(robot.cables)
    if format in FIRMWARES:
        kind, least, most = FIRMWARES[format]
        level = motion.axis in ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
        if robot.motion != kind or not least <= m <= most or (kind == "2T" and not level):
            found += f", {m} cables"
            accepted = f"{kind} on {least} to {most} cables"
            accepted += ", with axis y or z" if kind == "2T" else ""
    elif format == "caspr" and motion.rows is None:
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


def checked_robot(path: Path) -> tuple[str, list[str], None] | None:
    """What a robot of another tool is, and notes on it, for `check_files`; None of other files."""
    if not is_foreign(path):
        return None
    imported = import_robot(path)
    assumed = [f"assumed {key}: {words}" for key, words in imported.completed.assumed.items()]
    notes = [*assumed, *imported.completed.remarks, *point_notes(imported.robot)]
    return f"robot, {imported.tool}", notes, None
