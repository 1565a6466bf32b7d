"""Robots of WireX and WireCenter, as `wcrfx` files.

A chain gives the point of the base with a frame, whose z axis is that of the swivelling pulley and
whose matrix is written column by column, and the point of the platform; cables, winches and drums
are types that chains refer to by name.

Source: A. Pott, Cable-Driven Parallel Robots, Springer 2018; the files of WireCenter.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.formats.draft import DraftCable, RobotDraft
from cdpr_drake.formats.unread import mark, mark_below, not_kept, watched
from cdpr_drake.models.foreign_text import fail, number, read_xml, robot_name

TOOL = "WireX wcrfx"

_UNIT = 1e-3
"""By how much columns of a matrix may differ from unit length."""

_PRESENTATION = {"@id", "@generator", "@version", "@description", "@name", "@nr_cables", "@author"}
"""What only names things, or says who wrote the file."""

_MOTIONS = {"3R3T": "3R3T", "1R2T": "2T1R", "2T1R": "2T1R", "3T": "3T", "2T": "2T", "1T": "1T",
            "2R3T": "2R3T"}  # fmt: skip


def read_wirex(path: Path) -> RobotDraft:
    """Reads the robot of a wcrfx file.

    Raises:
        RobotFileError: The file does not describe one; says where.
    """
    root = watched(read_xml(path))
    robots = [root] if root.tag == "robot" else root.findall("robot")
    if len(robots) != 1:
        names = ", ".join(robot.get("name", "?") for robot in robots) or "none"
        raise fail(path, "robot", names, "one robot")
    robot = robots[0]
    words = robot.get("name") or path.stem
    draft = RobotDraft(name=robot_name(words), tool=TOOL, title=robot.get("description") or words)
    pattern = robot.get("motionpattern", "3R3T").upper()
    if pattern not in _MOTIONS:
        raise fail(path, "motionpattern", pattern, "one of " + ", ".join(_MOTIONS))
    draft.motion = _MOTIONS[pattern]
    winches = {winch.get("name", ""): winch for winch in root.iter("winch")}
    types = set()
    for index, chain in enumerate(robot.iter("chain")):
        kind = chain.get("winchtype", "")
        types.add(kind)
        draft.cables.append(_chain(path, chain, index, winches.get(kind)))
    if not draft.cables:
        raise fail(path, "geometry", "no chain", "at least one")
    _platform(path, robot, draft)
    _cable_type(path, root, draft)
    if len(types) == 1 and types & set(winches):
        _winch(path, winches[types.pop()], draft)
    elif types - set(winches):
        missing = ", ".join(sorted(types - set(winches))) or "none"
        draft.remarks.append(f"The file has no winch of the type {missing}.")
    else:
        draft.remarks.append(f"Chains have winches of {len(types)} types; their motors were not "
                             "kept, since a robot here has one type.")  # fmt: skip
        for name in types:
            mark_below(winches[name])
    draft.remarks += not_kept(root, _PRESENTATION)
    return draft


def _value(path: Path, item: ET.Element, key: str, where: str) -> float:
    return number(path, f"{where}.{key}", item.get(key))


def _optional(path: Path, item: ET.Element | None, key: str, where: str) -> float | None:
    """A number that is above 0, or None: these files have 0 where nothing is known."""
    if item is None or item.get(key) is None:
        return None
    value = number(path, f"{where}.{key}", item.get(key))
    return value if value > 0.0 else None


def _point(path: Path, item: ET.Element, where: str) -> Array:
    return np.array([_value(path, item, axis, where) for axis in "xyz"])


def _chain(path: Path, chain: ET.Element, index: int, winch: ET.Element | None) -> DraftCable:
    where = f"chain {chain.get('id', index + 1)}"
    base, platform = chain.find("base"), chain.find("platform")
    if base is None or platform is None:
        raise fail(path, where, "no base or no platform", "elements <base> and <platform>")
    for end in (base, platform):  # whose x and y axes are where swivel angles count from
        mark(end, *(f"a{row}{column}" for row in (1, 2, 3) for column in (1, 2)))
    mark(platform, "a13", "a23", "a33")
    axis = None
    if base.get("a33") is not None:  # the third column: a13, a23, a33
        axis = np.array([_value(path, base, f"a{k}3", where) for k in (1, 2, 3)])
        size = float(np.linalg.norm(axis))
        if abs(size - 1.0) > _UNIT:
            raise fail(path, f"{where}, a13 a23 a33", axis.tolist(), "a column of length 1")
        axis /= size
    forces = None if winch is None else winch.find("cable")
    return DraftCable(
        name=f"C{index + 1}",
        exit_point=_point(path, base, f"{where}.base"),
        anchor_point=_point(path, platform, f"{where}.platform"),
        upper=_optional(path, forces, "f_max", "winch.cable"),
        pulley_radius=0.0
        if base.get("radius") is None
        else _value(path, base, "radius", f"{where}.base"),
        swivel_axis=axis,
    )


def _platform(path: Path, robot: ET.Element, draft: RobotDraft) -> None:
    platform = robot.find("platform")
    if platform is None:
        raise fail(path, "platform", "none", "an element <platform> with the mass")
    draft.mass = _value(path, platform, "mass", "platform")
    center = platform.find("centerofgravity")
    draft.center_of_mass = (
        np.zeros(3) if center is None else _point(path, center, "centerofgravity")
    )
    tensor = platform.find("inertiatensor")
    if tensor is not None:
        given = {
            key: number(path, f"inertiatensor.{key}", tensor.get(key))
            for key in ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
            if tensor.get(key) is not None
        }
        moments = [given.get(key) for key in ("Ixx", "Iyy", "Izz")]
        if given.get("Ixx", 0.0) > 0.0 and moments[1] is None and moments[2] is None:
            draft.remarks.append("The file gives Ixx only; it was taken for all three moments.")
            moments = [given["Ixx"]] * 3
        if None not in moments:
            draft.inertia = np.array(
                [*moments, *(given.get(key, 0.0) for key in ("Ixy", "Ixz", "Iyz"))], float
            )
    reach = float(np.max(np.linalg.norm(draft.anchor_points(), axis=0)))
    distance = float(np.linalg.norm(draft.center_of_mass))
    if distance > 2.0 * max(reach, 1e-9):
        draft.remarks.append(
            f"The centre of gravity lies {distance:.3g} m from Po, {distance / reach:.3g} times as "
            "far as the anchor points; kept as given."
        )


def _cable_type(path: Path, root: ET.Element, draft: RobotDraft) -> None:
    cable = root.find("cable")
    if cable is None:
        return
    radius = _optional(path, cable, "radius", "cable")
    draft.diameter = None if radius is None else 2.0 * radius
    draft.youngs_modulus = _optional(path, cable, "elasticity", "cable")
    draft.linear_density = _optional(path, cable, "weight", "cable")
    draft.breaking_load = _optional(path, cable, "breaking_load", "cable")
    lower = cable.get("minimum_load")
    for item in draft.cables:
        item.lower = None if lower is None else number(path, "cable.minimum_load", lower)
    if cable.get("damping") is not None:
        draft.remarks.append(
            f"cable.damping, {cable.get('damping')}, has no unit in the file and was not kept."
        )


def _winch(path: Path, winch: ET.Element, draft: RobotDraft) -> None:
    drum, motor, cable = winch.find("drum"), winch.find("motor"), winch.find("cable")
    draft.drum_radius = _optional(path, drum, "r_drum", "winch.drum")
    draft.gear_ratio = _optional(path, motor, "gear_ratio", "winch.motor")
    draft.motor_inertia = _optional(path, motor, "inertia", "winch.motor")
    draft.motor_speed_rpm = _optional(path, motor, "angular_velocity", "winch.motor")
    if draft.motor_speed_rpm is None:
        draft.cable_speed = _optional(path, cable, "max_velocity", "winch.cable")
    else:
        draft.remarks.append("motor.angular_velocity was taken for turns per minute.")


def write_wirex(draft: RobotDraft) -> str:
    """The robot as a wcrfx file.

    It holds points, pulleys, mass, inertia, centre of mass, cables, drum, gear, motor and tension
    limits; neither a home pose, a frame nor the platform's shape.
    """
    assert draft.center_of_mass is not None
    assert draft.inertia is not None
    models = ET.Element("models", version="0.31")
    robot = ET.SubElement(
        models, "robot", name=draft.name, id="1.0", generator="cdpr_drake",
        description=draft.title,
        motionpattern="1R2T" if draft.motion == "2T1R" else draft.motion or "3R3T",
    )  # fmt: skip
    geometry = ET.SubElement(robot, "geometry")
    for index, cable in enumerate(draft.cables):
        chain = ET.SubElement(geometry, "chain", id=str(index + 1), winchtype="winch")
        ET.SubElement(
            chain, "base", _pose(cable.exit_point, cable.swivel_axis)
            | {"radius": repr(float(cable.pulley_radius or 0.0))},
        )  # fmt: skip
        ET.SubElement(chain, "platform", _pose(cable.anchor_point, None))
    platform = ET.SubElement(
        robot, "platform", name="platform", description="", mass=repr(float(draft.mass or 0.0))
    )
    keys = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
    ET.SubElement(
        platform, "inertiatensor",
        {key: repr(float(value)) for key, value in zip(keys, draft.inertia, strict=True)},
    )  # fmt: skip
    com = {
        axis: repr(float(value)) for axis, value in zip("xyz", draft.center_of_mass, strict=True)
    }
    ET.SubElement(platform, "centerofgravity", com)
    lower = max(cable.lower or 0.0 for cable in draft.cables)
    upper = min(cable.upper or 0.0 for cable in draft.cables)
    ET.SubElement(
        models, "cable", name="cable", elasticity=repr(float(draft.youngs_modulus or 0.0)),
        radius=repr(float(draft.diameter or 0.0) / 2.0), minimum_load=repr(float(lower)),
        breaking_load=repr(float(draft.breaking_load or 0.0)),
        weight=repr(float(draft.linear_density or 0.0)),
    )  # fmt: skip
    winch = ET.SubElement(models, "winch", name="winch", description="")
    ET.SubElement(winch, "cable", nr_cables="1", f_max=repr(float(upper)))
    ET.SubElement(
        winch, "motor", inertia=repr(float(draft.motor_inertia or 0.0)),
        angular_velocity=repr(float(draft.motor_speed_rpm or 0.0)),
        gear_ratio=repr(float(draft.gear_ratio or 0.0)),
    )  # fmt: skip
    ET.SubElement(winch, "drum", r_drum=repr(float(draft.drum_radius or 0.0)))
    ET.indent(models, "    ")
    return ET.tostring(models, encoding="unicode") + "\n"


def _pose(point: Array, z_axis: Array | None) -> dict[str, str]:
    """Attributes of a point and a frame there with that z axis, column by column."""
    R = np.eye(3) if z_axis is None else _frame_about(np.asarray(z_axis, float))
    words = {axis: repr(float(value)) for axis, value in zip("xyz", point, strict=True)}
    for column in range(3):
        for row in range(3):
            words[f"a{row + 1}{column + 1}"] = repr(float(R[row, column]))
    return words


def _frame_about(axis: Array) -> Array:
    z = axis / np.linalg.norm(axis)
    other = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(other, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
