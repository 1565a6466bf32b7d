"""CASPR models: bodies, cables and a list of models, as XML and CSV files.

A model is `NAME_bodies.xml` beside `NAME_cables.xml`; a list names folders and files, whose upper
and lower case may differ from those on disk. Points of cables are relative to the joint or to the
centre of mass of their link; link 0 is the world. Joints are in radians, R = Rx Ry Rz; gravity is
9.81 m/s^2 along -z.

Source: github.com/darwinlau/CASPR, its model files and their templates.
"""

from __future__ import annotations

import csv
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from pydrake.common.eigen_geometry import AngleAxis, Quaternion
from pydrake.math import RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.errors import RobotFileError
from cdpr_drake.formats.caspr_pulleys import PULLEYS, read_pulley, short_name, triple
from cdpr_drake.formats.caspr_trees import AXIS_KINDS, KINDS, PRESENTATION, QUATERNIONS
from cdpr_drake.formats.draft import DraftCable, RobotDraft
from cdpr_drake.formats.unread import mark_below, not_kept, watched
from cdpr_drake.models.foreign_text import (
    child_text,
    fail,
    near_file,
    number,
    numbers,
    read_text,
    read_xml,
    robot_name,
)

TOOL = "CASPR XML"

MOTIONS = {
    "SPATIAL_EULER_XYZ": "3R3T",
    "SPATIAL_QUATERNION": "3R3T",
    "PLANAR_XY": "2T1R",
    "PLANAR_XZ": "2T1R",
    "PLANAR_YZ": "2T1R",
    "T_XYZ": "3T",
    "P_XY": "2T",
    "P_XZ": "2T",
    "P_YZ": "2T",
    "P_X": "1T",
    "P_Y": "1T",
    "P_Z": "1T",
}
"""Joints of one body that cables move as a whole, and the motion that each gives."""

_COORDINATES = {"SPATIAL_EULER_XYZ": 6, "SPATIAL_QUATERNION": 7}
"""Numbers of the joints that are no translations along axes with a turn about the third."""


def caspr_models(path: Path) -> dict[str, tuple[Path, Path]]:
    """Names of a CASPR list of models, with the files of bodies and cables as the list has them.

    Raises:
        RobotFileError: The file is no such list.
    """
    found = {}
    try:
        rows = list(csv.reader(read_text(path).splitlines()))
    except csv.Error as problem:
        raise RobotFileError(f"{path}: cannot be read as a table: {problem}") from problem
    for row in rows:
        if len(row) >= 4 and row[2].endswith(".xml") and row[3].endswith(".xml"):
            folder = path.parent / row[1].strip().strip("/")
            found[row[0].strip()] = folder / row[2].strip(), folder / row[3].strip()
    if not found:
        raise fail(path, "rows", "none of a model", "name, folder, bodies file, cables file")
    return found


def is_caspr_tree(bodies: Path) -> bool:
    """Whether a bodies file has several links, or a joint that no platform on cables has.

    Raises:
        RobotFileError: It cannot be read.
    """
    links = list(read_xml(bodies).iter("link_rigid"))
    if len(links) != 1:
        return len(links) > 1
    joint = links[0].find("joint")
    kind = "" if joint is None else joint.get("type", "").upper()
    return kind not in MOTIONS and (kind in KINDS or kind in AXIS_KINDS or kind in QUATERNIONS)


def read_caspr(path: Path, model: str | None = None, cable_set: str | None = None) -> RobotDraft:
    """Reads a CASPR model.

    Args:
        path: Its bodies or cables file, its folder, or a list of models.
        model: Of a list: the name of the model.
        cable_set: The set of cables; None: the default one of the file.

    Raises:
        RobotFileError: The files do not describe a cable robot; says where.
    """
    bodies, cables, name = model_files(path, model)
    root = watched(read_xml(bodies))
    link, joint = _only_link(bodies, root)
    kind = joint[0]
    if kind not in MOTIONS:
        raise fail(
            bodies, "joint", kind,
            "a body that cables move freely, " + ", ".join(MOTIONS) + "; this is a model in joint "
            "space, no cable robot; cdpr import makes a mechanism of it",
        )  # fmt: skip
    draft = RobotDraft(name=robot_name(name), tool=TOOL, title=link.get("name", name))
    draft.motion, draft.gravity = MOTIONS[kind], 9.81
    offset = _body(bodies, link, draft)
    _coordinates(bodies, kind, joint[1], offset, draft)
    system = root if root.tag == "links" else root.find("links")
    _display_range(bodies, system, draft)
    _cables(cables, cable_set, draft)
    draft.remarks += not_kept(root, PRESENTATION)
    return draft


def model_files(path: Path, model: str | None = None) -> tuple[Path, Path, str]:
    """Files of bodies and cables of a model, and its name.

    Args:
        path: Its bodies or cables file, its folder, or a list of models.
        model: Of a list: the name of the model.

    Raises:
        RobotFileError: There are no such files, or no such model in the list.
    """
    if path.suffix.lower() == ".csv":
        models = caspr_models(path)
        names = {name.lower(): name for name in models}
        if model is None or model.lower() not in names:
            known = ", ".join(models)
            what = "nothing" if model is None else model
            raise RobotFileError(f"{path}: model: found {what}; accepted: {known[:380]}")
        name = names[model.lower()]
        found = [near_file(file) for file in models[name]]
        for file, wanted in zip(found, models[name], strict=True):
            if file is None:
                raise RobotFileError(f"{path}: {name}: there is no file {wanted}")
        assert found[0] is not None
        assert found[1] is not None
        return found[0], found[1], name
    folder = path if path.is_dir() else path.parent
    files = sorted(folder.glob("*.[xX][mM][lL]"))
    if path.is_dir():
        bodies = [file for file in files if _part(file) == "bodies"]
        if len(bodies) != 1:
            there = ", ".join(file.name for file in bodies) or "none"
            raise fail(path, "files of bodies", there, "one, NAME_bodies.xml")
        path = bodies[0]
    stem = _stem(path)
    parts = {_part(file): file for file in files if _stem(file).lower() == stem.lower()}
    for part in ("bodies", "cables"):
        if part not in parts:
            raise RobotFileError(f"{folder}: there is no file {stem}_{part}.xml beside {path.name}")
    return parts["bodies"], parts["cables"], stem


_ENDINGS = re.compile(r"_(bod(?:y|ies)|cables?)(?:_propert(?:y|ies))?$", re.IGNORECASE)


def _part(path: Path) -> str:
    """bodies or cables, by the file's name; older files end in body_properties."""
    ending = _ENDINGS.search(path.stem)
    if ending is None:
        return ""
    return "bodies" if ending.group(1).lower().startswith("bod") else "cables"


def _stem(path: Path) -> str:
    return _ENDINGS.sub("", path.stem)


def _only_link(path: Path, root: ET.Element) -> tuple[ET.Element, tuple[str, ET.Element]]:
    """The one rigid body of a model, and its joint."""
    links = list(root.iter("link_rigid"))
    if len(links) != 1:
        raise fail(
            path, "link_rigid", f"{len(links)} bodies",
            "one body that cables move; more are a model in joint space, no cable robot; cdpr "
            "import makes a mechanism of it",
        )  # fmt: skip
    joint = links[0].find("joint")
    if joint is not None:
        return links[0], (joint.get("type", "").upper(), joint)
    old = links[0].find("joint_type")
    if old is None or not (old.text or "").strip():
        raise fail(path, "link_rigid", "no joint", "an element <joint type=...>")
    return links[0], ((old.text or "").strip().upper(), old)


def _body(path: Path, link: ET.Element, draft: RobotDraft) -> Array:
    """Mass, centre of mass and inertia; returns where the joint's frame lies in W [m]."""
    physical = link.find("physical")
    if physical is None:
        raise fail(path, "link_rigid", "no physical", "an element <physical>")
    draft.mass = number(path, "physical.mass", child_text(path, physical, "mass", "physical.mass"))
    com = child_text(path, physical, "com_location", "physical.com_location")
    draft.center_of_mass = numbers(path, "physical.com_location", com, 3)
    inertia = physical.find("inertia")
    if inertia is not None:
        values = np.array(
            [
                number(path, f"inertia.{key}", (inertia.findtext(key) or "0").strip() or "0")
                for key in ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
            ]
        )
        reference = inertia.get("ref", "com")
        if reference != "com":
            values = _about_com(values, draft.mass, draft.center_of_mass)
            draft.remarks.append(f"Inertia is given about {reference}; turned to that about the "
                                 "centre of mass.")  # fmt: skip
        draft.inertia = values
    parent = (link.findtext("parent/num") or "0").strip()
    if parent != "0":
        raise fail(path, "parent.num", parent, "0, the world")
    location = link.findtext("parent/location") or "0 0 0"
    return numbers(path, "parent.location", location, 3)


def _about_com(values: Array, mass: float, com: Array) -> Array:
    """Moments and products about the centre of mass, from those about the joint."""
    shift = mass * (float(com @ com) * np.eye(3) - np.outer(com, com))
    return values - np.array(
        [shift[0, 0], shift[1, 1], shift[2, 2], shift[0, 1], shift[0, 2], shift[1, 2]]
    )


def _coordinates(
    path: Path, kind: str, joint: ET.Element, offset: Array, draft: RobotDraft
) -> None:
    """The home pose from the initial coordinates, and the frame from their limits."""
    moved, draft.origin = _moved(kind), offset
    count = _COORDINATES.get(kind, len(moved) + (kind[:6] == "PLANAR"))
    given = joint.get("q_initial")
    q = np.zeros(count) if given is None else numbers(path, "joint.q_initial", given, count)
    position, R = np.zeros(3), RotationMatrix()
    position[moved] = q[: len(moved)]
    if kind == "SPATIAL_QUATERNION":
        if not np.any(q[3:]):
            raise fail(path, "joint.q_initial", given, "a quaternion that is not zero")
        R = RotationMatrix(Quaternion(q[3:] / np.linalg.norm(q[3:])))
    elif kind == "SPATIAL_EULER_XYZ":
        R = _euler_xyz(q[3:], draft)
    elif draft.motion in ("2T1R", "2T"):
        normal = np.eye(3)[3 - sum(moved)]
        if kind[:6] == "PLANAR":
            R = RotationMatrix(AngleAxis(q[2], normal))
        if normal[2] == 1.0:
            draft.plane_height = float(offset[2])
        else:
            draft.axis = normal
    elif draft.motion == "1T":
        draft.axis = np.eye(3)[moved[0]]
    draft.R_WP = R.matrix()
    if given is not None:
        draft.home_position = offset + position
    if count < 3:
        return
    low, high = joint.get("q_min"), joint.get("q_max")
    if low is None or high is None:
        return
    n = len(moved)
    lower = numbers(path, "joint.q_min", low, count)[:n]
    upper = numbers(path, "joint.q_max", high, count)[:n]
    if np.all(lower < upper) and np.all(upper - lower < 1e4):
        draft.frame_lower, draft.frame_upper = np.copy(offset), np.copy(offset)
        draft.frame_lower[moved] += lower
        draft.frame_upper[moved] += upper
        draft.remarks.append("The frame encloses the limits of the joint and the exit points.")


def _moved(kind: str) -> list[int]:
    """Axes of W along which a joint moves, in the order of its coordinates."""
    if kind in _COORDINATES:
        return [0, 1, 2]
    return ["XYZ".index(letter) for letter in kind.split("_")[1]]


def _euler_xyz(angles: Array, draft: RobotDraft) -> RotationMatrix:
    if np.any(np.abs(angles) > 2.0 * np.pi):
        draft.remarks.append("Angles of q_initial are beyond 2 pi and were taken for degrees.")
        angles = np.radians(angles)
    x, y, z = (
        RotationMatrix.MakeXRotation(angles[0]),
        RotationMatrix.MakeYRotation(angles[1]),
        RotationMatrix.MakeZRotation(angles[2]),
    )
    return x @ y @ z


def _display_range(path: Path, system: ET.Element | None, draft: RobotDraft) -> None:
    if system is None or draft.frame_lower is not None:
        return
    words = system.get("display_range") or (system.findtext("display_range") or "")
    if words.strip():
        values = numbers(path, "display_range", words, 6)
        if np.all(values[::2] < values[1::2]):
            draft.frame_lower, draft.frame_upper = values[::2], values[1::2]


def _cables(path: Path, wanted: str | None, draft: RobotDraft) -> None:
    root = watched(read_xml(path))
    sets = {item.get("id", ""): item for item in root.iter("cable_set")}
    if not sets:
        raise fail(path, "cable_set", "none", "at least one")
    name = wanted or root.get("default_cable_set") or next(iter(sets))
    if name not in sets:
        raise fail(path, "default_cable_set", name, "one of " + ", ".join(sets))
    others = [other for other in sets if other != name]
    if others:
        draft.remarks.append(f"Cables of the set {name}; the file also has {', '.join(others)}.")
        for other in others:
            mark_below(sets[other])
    kinds: set[str] = set()
    for item in sets[name]:
        if not item.tag.startswith("cable_"):
            continue
        if "passive" in item.tag:
            draft.remarks.append(f"{item.get('name', 'a spring')}, a passive spring, was left out.")
            mark_below(item)
            continue
        kinds.add(item.tag)
        draft.cables.append(_cable(path, item, draft))
    if not draft.cables:
        raise fail(path, f"cable_set {name}", "no cable", "at least one")
    if kinds - {"cable_ideal"}:
        draft.remarks.append(
            f"Cables are of the kind {', '.join(sorted(kinds))}; their stiffness was not kept."
        )
    draft.remarks += not_kept(root, PRESENTATION)


def _cable(path: Path, item: ET.Element, draft: RobotDraft) -> DraftCable:
    name = item.get("name") or f"cable {len(draft.cables) + 1}"
    ends: dict[int, list[Array]] = {0: [], 1: []}
    order = []
    radius, axis = None, None
    holder = item.find("attachments")
    for index, attachment in enumerate(item if holder is None else holder):
        where = f"{name}, attachment {index + 1}"
        if attachment.tag in PULLEYS:
            pulley = read_pulley(path, attachment, where, draft.remarks)
            ends[0].append(pulley.point)
            order.append(0)
            radius, axis = pulley.radius, pulley.entry
            continue
        if attachment.tag != "attachment":
            continue
        link = int(number(path, where, child_text(path, attachment, "link", where)))
        if link not in ends:
            raise fail(path, f"{where}, link", link, "0, the world, or 1, the platform")
        point = triple(path, attachment, "location", where)
        if link == 1 and item.get("attachment_reference", "joint") == "com":
            assert draft.center_of_mass is not None
            point = draft.center_of_mass + point
        ends[link].append(point)
        order.append(link)
    if not ends[0] or len(ends[1]) != 1 or order != sorted(order, reverse=order[0] == 1):
        raise fail(
            path, name, f"attachments to links {order}", "points of the world, then one of the body"
        )
    if len(ends[0]) > 1:
        draft.remarks.append(
            f"{name} runs over {len(ends[0])} points of the world; it leaves from the last one."
        )
    exit_point = ends[0][-1] if order[0] == 0 else ends[0][0]
    properties = item.find("properties")
    limits: list[float | None] = [None, None]
    if properties is not None:
        for k, key in enumerate(("force_min", "force_max")):
            force = properties.findtext(key)
            limits[k] = None if force is None else number(path, f"{name}, {key}", force)
    return DraftCable(
        name=short_name(name), exit_point=exit_point, anchor_point=ends[1][0], lower=limits[0],
        upper=limits[1], pulley_radius=radius, swivel_axis=axis,
    )  # fmt: skip
