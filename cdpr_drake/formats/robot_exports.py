"""What of a robot the formats of other tools hold, field by field of the schema.

A format holds what `HELD` says; all else that a robot file gives is left out and named, also a
field that the schema gets later.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import is_dataclass
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import RobotFileError, accepted_names
from cdpr_drake.formats import klipper, reprapfirmware
from cdpr_drake.formats.assumptions import complete_draft
from cdpr_drake.formats.caspr_pulleys import short_name
from cdpr_drake.formats.draft import DraftCable, RobotDraft
from cdpr_drake.formats.named_frames import is_frame_name
from cdpr_drake.models.file_kinds import MASLOW_CORNERS
from cdpr_drake.models.foreign_text import robot_name
from cdpr_drake.models.robot_copies import gravity_turn, turned_robot, world_turn
from cdpr_drake.models.robot_holding import lengths_at_home
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import number_words, settings_of

EXPORTS = {
    "sdf": "SDFormat with chains of joints for cables, closed by ball joints, for Gazebo",
    "sdf-drake": "the same, closed by Drake's ball constraints, for Drake's parser",
    "urdf": "URDF of the platform with named frames for the points",
    "drake": "a package of that URDF with model directives, for Drake's ProcessModelDirectives",
    "mjcf": "MJCF with spatial tendons, for MuJoCo",
    "wcrfx": "WireX and WireCenter",
    "caspr": "CASPR, two XML files",
    "gazebo-yaml": "the Gazebo cable robot simulator's YAML",
    "klipper": "sections of Klipper's printer.cfg for kinematics: winch, point masses",
    "reprapfirmware": "the lines M669 and M666 of RepRapFirmware's config.g, point masses",
    "maslow": "anchors of a maslow.yaml, four belts in a plane",
}
"""Formats that robots are written in, with what each is."""

_COMMON = {
    "name", "motion", "axis", "platform.mass", "platform.inertia", "platform.inertia_of",
    "cables[].name", "cables[].exit_point", "cables[].anchor_point",
}  # fmt: skip
_CENTER, _BOX = {"platform.center_of_mass"}, {"platform.size", "platform.box_center"}
_HOME = {"home.position", "home.angles_deg"}
_FRAME = {"frame.lower", "frame.upper", "frame.beam"}
_LIMITS = {"tension_bounds.lower", "tension_bounds.upper"}
_DIAMETERS = {"cable.diameter", "cables[].material.diameter"}
_PULLEYS = {
    "pulley.radius", "pulley.swivel_axis", "cables[].pulley_radius", "cables[].swivel_axis"
}  # fmt: skip
_ANCHORS = {"name", "motion", "cables[].name", "cables[].exit_point", "cables[].anchor_point"}
_SDF = _COMMON | _CENTER | _BOX | _HOME | _FRAME | _DIAMETERS | {"tension_bounds.upper"}

HELD: dict[str, set[str]] = {
    "sdf": _SDF,
    "sdf-drake": _SDF,
    "urdf": _COMMON | _CENTER | _BOX | _HOME | _FRAME,
    "drake": _COMMON | _CENTER | _BOX | _HOME | _FRAME,
    "mjcf": _COMMON | _CENTER | _BOX | _HOME | _DIAMETERS | _LIMITS
    | {"plane_height", "gravity", "gravity_direction",
       "cable.youngs_modulus", "cables[].material.youngs_modulus"},
    "wcrfx": _COMMON | _CENTER | _PULLEYS | _LIMITS
    | {"title", "cable.youngs_modulus", "cable.diameter", "cable.linear_density",
       "cable.breaking_load", "winch.drum_radius", "winch.gear_ratio", "winch.motor_speed_rpm",
       "winch.inertia"},
    "caspr": _COMMON | _CENTER | _HOME | _PULLEYS | _LIMITS
    | {"title", "plane_height", "frame.lower", "frame.upper"},
    "gazebo-yaml": _COMMON | _CENTER | _BOX | _HOME | _FRAME | _LIMITS | {"cable.diameter"},
    "klipper": _ANCHORS | {"winch.drum_radius", "winch.gear_ratio", "cables[].drum_radius"},
    "reprapfirmware": _ANCHORS | _LIMITS | {"platform.mass", "winch.drum_radius",
                                            "winch.gear_ratio", "cables[].drum_radius",
                                            "cables[].mechanical_advantage"},
    "maslow": _ANCHORS | {"axis", "pulley.arm"},
}  # fmt: skip
"""Keys of the schema that each format of `EXPORTS` holds, as its reader gets them back."""

_FIXED = "cables leave the frame from fixed exit points"
_FIXED_THERE = "cables hold the platform in fixed anchor points"
_WORDS = {
    "pulley.radius": _FIXED,
    "pulley.swivel_axis": _FIXED,
    "cables[].pulley_radius": _FIXED,
    "cables[].swivel_axis": _FIXED,
    "platform_pulley.": _FIXED_THERE,
    "cables[].anchor_pulley_radius": _FIXED_THERE,
    "cables[].anchor_swivel_axis": _FIXED_THERE,
    "cables[].rail.": "exit points were written where they stand",
    "cables[].winch": "each cable has a winch of its own there",
}
"""What replaces fields that are left out, by the beginnings of their keys."""

_IN_THE_PLACE = {
    "platform.shape.": ("platform.size", "the platform was written as its box"),
    "frame.beams[].": ("frame.lower", "the frame was written as the box that Po stays in"),
    "cables[].material.": ("cable.", "all cables were written as of the section `cable`"),
}
"""The same for formats that hold something else."""

_ASSUMED = "frame.assumed"
"""Mark of a frame that no file gave: it follows from what of the frame comes back."""

_TAKEN = ("exit_", "anchor_", "guide_", "rod_", "turn_", "hold_", "__")
_NAMES = ("world", "frame", "platform", "frame_to_world", "home")

_IN_W = {
    "axis", "plane_height", "cables[].exit_point", "home.position", "home.angles_deg",
    "pulley.swivel_axis", "cables[].swivel_axis", "frame.lower", "frame.upper",
}  # fmt: skip
"""What is given in W and differs in a world that was turned for a format."""

_AT_ZERO = ("pulley.radius", "platform_pulley.radius", "tension_bounds.lower")
"""Fields that have to be given, and say at zero what formats without them mean."""

_AT_NULL = ("platform.box_center", "platform.center_of_mass", "platform.inertia", "frame.beam")
"""Fields whose null stands for a value that follows from others."""


def given_fields(robot: Robot) -> tuple[str, ...]:
    """Keys of all fields in which a robot says more than the schema fills in by itself.

    They are those that have no fields of their own: `platform.mass`, and with brackets for the
    items of a list `cables[].material.diameter`. A section that is left out is one field; one that
    may be left out and is there says all that it has.
    """
    found = [
        key
        for key, value, default in _leaves(robot, "", False)
        if (key in _AT_NULL or not default) and not (key in _AT_ZERO and value == 0.0)
    ]
    return tuple(dict.fromkeys(found))


def _leaves(section: Any, prefix: str, added: bool) -> Iterator[tuple[str, Any, bool]]:
    """Key, value, and whether that is what there is without the file.

    In a section that was added to what the schema fills in, only null is.
    """
    for name, setting in settings_of(type(section)).items():
        key, value = f"{prefix}{name}", getattr(section, name)
        items = value if isinstance(value, list) else [value]
        if items and is_dataclass(items[0]):
            more = added or (not is_dataclass(setting.default) and not setting.required)
            mark = "[]." if isinstance(value, list) else "."
            for item in items:
                yield from _leaves(item, key + mark, more)
        elif value is None or added or setting.required:
            yield key, value, value is None and not setting.required
        else:
            yield key, value, bool(np.array_equal(value, setting.default))


def export_omissions(robot: Robot, format: str) -> dict[str, str]:
    """What a robot file gives and a format does not hold.

    Args:
        robot: The robot.
        format: A name of `EXPORTS`.

    Returns:
        By the key of each field what became of it, in words. `home` alone says why the robot is
        not at rest at home in a format that is a simulation.

    Raises:
        RobotFileError: There is no such format.
    """
    check_format(format)
    turn, words = gravity_turn(robot), world_turn(robot, format)
    if turn is not None and words:
        seen = turned_robot(robot, turn)
        lost = export_omissions(seen, format)
        held = {*given_fields(robot), *given_fields(seen)} & HELD[format] & _IN_W
        lost |= dict.fromkeys(held - set(lost), "turned with the world") | {
            "gravity_direction": words
        }
        return {key: lost[key] for key in sorted(lost)}
    lost = {
        key: _words(key, robot, format)
        for key in given_fields(robot)
        if key not in HELD[format] and key != _ASSUMED
    }
    for rule in _RULES:
        lost |= rule(robot, format)
    return {key: lost[key] for key in sorted(lost)}


def check_format(format: str) -> None:
    """Refuses a format that is not in `EXPORTS`.

    Raises:
        RobotFileError: It is not.
    """
    if format not in EXPORTS:
        raise RobotFileError(f"format: found {format}; {accepted_names(format, EXPORTS)}")


def omission_words(lost: dict[str, str]) -> list[str]:
    """What was not written, a line for all fields of which the same became."""
    keys: dict[str, list[str]] = {}
    for key, words in lost.items():
        keys.setdefault(words, []).append(key)
    return [f"not written: {', '.join(names)} ({words})" for words, names in keys.items()]


def _words(key: str, robot: Robot, format: str) -> str:
    if key == "winch.motor_speed_rpm" and format in ("sdf", "sdf-drake", "gazebo-yaml", "klipper"):
        speed = robot.winch.rated_cable_speed()
        return f"written as the speed of the cables, {speed:.6g} m/s"
    if key == "cable.youngs_modulus" and format == "reprapfirmware":
        cable = robot.cable
        stiffness = reprapfirmware.cable_stiffness(cable.youngs_modulus, cable.diameter)
        return f"written as E S, {stiffness:.6g} N"
    if key.startswith("home.") and format in ("klipper", "reprapfirmware"):
        return "lengths count from the origin there"
    if key == "cable.retardation_time" and format == "mjcf":
        return "tendons are undamped, since MuJoCo damps slack ones as well"
    for start, words in _WORDS.items():
        if key.startswith(start):
            return words
    for start, (other, words) in _IN_THE_PLACE.items():
        last = key.rpartition(".")[2] if other.endswith(".") else ""
        if key.startswith(start) and f"{other}{last}" in HELD[format]:
            return words
    return f"{format} has no place for it"


def _name_of_robot(robot: Robot, format: str) -> dict[str, str]:
    again = robot_name(robot.name)
    return {} if again == robot.name else {"name": f"is read back as {again}"}


_FIRMWARE_NAMES: dict[str, Sequence[str]] = {
    "klipper": klipper.LETTERS,
    "reprapfirmware": reprapfirmware.LETTERS,
    "maslow": MASLOW_CORNERS,
}
"""Names of cables of firmwares, by their places."""


def names_in_file(names: Sequence[str], format: str) -> list[str]:
    """Names of cables as a format has them: their own, or C and the place where it cannot.

    Firmwares have names of their own.
    """
    if format in _FIRMWARE_NAMES:
        known = _FIRMWARE_NAMES[format]  # robots with more cables are refused by their motion
        return [*known[: len(names)], *(f"C{k + 1}" for k in range(len(known), len(names)))]
    kept = {name for place, name in enumerate(names, start=1) if _holds_name(format, name, place)}
    found = []
    for place, name in enumerate(names, start=1):
        if not _holds_name(format, name, place):
            free = (f"C{k}" for k in range(place, place + 2 * len(names) + 1))
            name = next(other for other in free if other not in kept)
            kept.add(name)
        found.append(name)
    return found


def xml_words(words: str) -> str:
    """Words without the letters that XML cannot hold, as control characters."""
    return re.sub("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "", words)


def _is_xml(words: str) -> bool:
    return xml_words(words) == words


def _holds_name(format: str, name: str, place: int) -> bool:
    """Whether a cable's name is read back from a file; its place counts from 1."""
    if format in ("wcrfx", "gazebo-yaml"):  # which number cables
        return name == f"C{place}"
    if format == "caspr":
        return _is_xml(name) and short_name(name) == name != ""
    if format == "mjcf":
        return _is_xml(name) and name != ""
    if format in _FIRMWARE_NAMES:
        names = _FIRMWARE_NAMES[format]
        return place <= len(names) and name == names[place - 1]
    return (  # frames, links and joints of SDFormat and URDF
        _is_xml(name) and "::" not in name and name not in _NAMES
        and re.search(r"^ | $|  |[\t\n\r]", name) is None  # their parsers join such blanks
        and not name.startswith(_TAKEN) and is_frame_name(name)
    )  # fmt: skip


def _title(robot: Robot, format: str) -> dict[str, str]:
    if "title" not in HELD[format] or _is_xml(robot.title):
        return {}
    return {"title": "was written without letters that XML cannot hold"}


def _names_of_cables(robot: Robot, format: str) -> dict[str, str]:
    names = [cable.name for cable in robot.cables]
    changed = [
        f"{name!r} is {other}"
        for name, other in zip(names, names_in_file(names, format), strict=True)
        if name != other
    ]
    return {"cables[].name": ", ".join(changed)} if changed else {}


def _middle_of_box(robot: Robot, format: str) -> dict[str, str]:
    """That simulator's platform frame lies in the middle of the box, and so does its mass."""
    if format != "gazebo-yaml":
        return {}
    middle, lost = robot.box_center(), dict[str, str]()
    if np.any(middle):
        words = f"Po was put in the middle of the box, {number_words(middle)} m from here in P"
        keys = ("cables[].anchor_point", "home.position", "platform.box_center")
        lost = dict.fromkeys((*keys, "platform.center_of_mass"), words)
    if np.any(robot.center_of_mass() != middle):
        lost["platform.center_of_mass"] = "the mass was put in the middle of the box"
    return lost


def _axes_without_pulleys(robot: Robot, format: str) -> dict[str, str]:
    if format != "caspr":
        return {}
    lost = {}
    cables = robot.cable_set()
    for radius, axis, cable in zip(
        cables.pulley_radius, cables.swivel_axis.T, robot.cables, strict=True
    ):
        if radius == 0.0 and np.any(axis != (0.0, 0.0, 1.0)):
            key = "pulley.swivel_axis" if cable.swivel_axis is None else "cables[].swivel_axis"
            lost[key] = "CASPR has pulleys with a radius above 0 only"
    return lost


def _gear(robot: Robot, format: str) -> dict[str, str]:
    if format != "reprapfirmware":
        return {}
    lost = {}
    if not reprapfirmware.holds_gear(robot.winch.gear_ratio):
        lost["winch.gear_ratio"] = "gears have whole teeth there"
    if any(not float(cable.mechanical_advantage).is_integer() for cable in robot.cables):
        lost["cables[].mechanical_advantage"] = "lines are counted in whole numbers there"
    if robot.winch.layers is not None or np.any(robot.diameters() != reprapfirmware.DIAMETER):
        why = "the radius of the line at the origin is written, and is read back so"
        lost["winch.drum_radius"] = why
        if any(cable.drum_radius is not None for cable in robot.cables):
            lost["cables[].drum_radius"] = why
    return lost


def _inertia(robot: Robot, format: str) -> dict[str, str]:
    """Where a robot says no inertia, that of its box or shape is lost with the mass and size."""
    if "platform.inertia" in HELD[format]:
        return {}
    return {"platform.inertia_of": f"{format} has no place for it"}


def _frame(robot: Robot, format: str) -> dict[str, str]:
    """A frame that is flat, or does not enclose the exit points, is not read back as it was."""
    if "frame.lower" not in HELD[format]:
        return {} if robot.frame.assumed else {_ASSUMED: "the frame is assumed when it is read"}
    lower, upper = np.array(robot.frame.lower, float), np.array(robot.frame.upper, float)
    if format == "caspr":
        lower, upper = _moved_only(robot, lower), _moved_only(robot, upper)
    draft = RobotDraft(
        name="frame", tool=format, mass=1.0, motion=robot.motion, axis=robot.axis,
        frame_lower=lower, frame_upper=upper, home_position=robot.home.position,
        plane_height=robot.plane_height,
        cables=[
            DraftCable(name=cable.name, exit_point=A, anchor_point=cable.anchor_point)
            for cable, A in zip(robot.cables, robot.exit_points().T, strict=True)
        ],
    )  # fmt: skip
    again = complete_draft(draft).content["frame"]
    ends = {"lower": robot.frame.lower, "upper": robot.frame.upper}
    marked = bool(again.get("assumed", False))
    lost = {} if marked == robot.frame.assumed else {_ASSUMED: f"is read back as {marked}".lower()}
    return lost | {
        f"frame.{key}": f"is read back as {number_words(again[key])} m, round what the file shows"
        for key, value in ends.items()
        if not np.allclose(again[key], value, rtol=0.0, atol=1e-12)
    }


def _moved_only(robot: Robot, corner: Array) -> Array:
    """A corner as limits of a joint have it: only along axes that the platform moves along."""
    rows = robot.motion_type().rows
    if rows is None:
        return corner
    found = np.array(robot.home.position, float)
    if robot.plane_height is not None:
        found[2] = robot.plane_height
    moved = [row - 3 for row in rows if row >= 3]
    found[moved] = corner[moved]
    return found


def _rest(robot: Robot, format: str) -> dict[str, str]:
    why = lengths_at_home(robot)[1] if format == "mjcf" else ""
    return {"home": f"is no pose of rest, since {why}"} if why else {}


_RULES: tuple[Callable[[Robot, str], dict[str, str]], ...] = (
    _name_of_robot, _title, _names_of_cables, _middle_of_box, _axes_without_pulleys, _gear,
    _inertia, _frame, _rest,
)  # fmt: skip
"""What depends on values: fields that a format holds, but not all that may stand in them."""
