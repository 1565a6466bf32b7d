"""Writes CASPR models, of robots and of trees of links: bodies and cables as XML files.

Source: github.com/darwinlau/CASPR, its model files and their templates.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
from pydrake.math import RollPitchYaw, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.formats.caspr_trees import AXIS_KINDS, CasprCable, CasprLink, CasprTree
from cdpr_drake.formats.draft import RobotDraft

CABLE_SET = "original"
"""Name of the one set of cables that is written."""


def write_caspr(draft: RobotDraft) -> dict[str, str]:
    """The files of a CASPR model, by their endings: bodies and cables.

    They hold points, pulleys at exit points, mass, inertia, centre of mass, home pose, joint limits
    and tension limits; neither materials, winches nor the platform's shape.
    """
    assert draft.home_position is not None
    assert draft.R_WP is not None
    assert draft.inertia is not None
    assert draft.center_of_mass is not None
    assert draft.frame_lower is not None
    assert draft.frame_upper is not None
    rows = draft.motion_type().rows
    assert rows is not None
    moved = [row - 3 for row in rows if row >= 3]
    turned = [row for row in rows if row < 3]
    letters = "".join("XYZ"[k] for k in moved)
    joint = {6: "SPATIAL_EULER_XYZ", 1: f"P_{letters}", 2: f"P_{letters}"}.get(len(rows), "T_XYZ")
    if len(turned) == 1:
        joint = f"PLANAR_{letters}"
    offset = np.zeros(3)
    if len(moved) == 2:
        still = 3 - sum(moved)
        height = draft.plane_height if still == 2 else None
        offset[still] = draft.home_position[still] if height is None else height
    elif len(moved) == 1:
        offset = np.where(np.arange(3) == moved[0], 0.0, draft.home_position)
    angles = _angles_xyz(draft.R_WP)
    q = [*draft.home_position[moved], *angles[turned]]
    turns = [np.pi] * len(turned)
    low = [*(draft.frame_lower - offset)[moved], *(-np.array(turns))]
    high = [*(draft.frame_upper - offset)[moved], *turns]
    corners = np.column_stack([draft.frame_lower, draft.frame_upper]).ravel()
    system = ET.Element("bodies_system")
    links = ET.SubElement(system, "links", display_range=_numbers(corners), view_angle="-37 32")
    link = ET.SubElement(links, "link_rigid", num="1", name=draft.title or draft.name)
    ET.SubElement(
        link,
        "joint",
        type=joint,
        q_initial=_numbers(q),
        q_min=_numbers(low),
        q_max=_numbers(high),
    )
    physical = ET.SubElement(link, "physical")
    ET.SubElement(physical, "mass").text = repr(float(draft.mass or 0.0))
    ET.SubElement(physical, "com_location").text = _numbers(draft.center_of_mass)
    ET.SubElement(physical, "end_location").text = "0.0 0.0 0.0"
    _add_inertia(physical, draft.inertia)
    parent = ET.SubElement(link, "parent")
    ET.SubElement(parent, "num").text = "0"
    ET.SubElement(parent, "location").text = _numbers(offset)
    root = ET.Element("cables", default_cable_set=CABLE_SET)
    cables = ET.SubElement(root, "cable_set", id=CABLE_SET)
    for cable in draft.cables:
        item = ET.SubElement(cables, "cable_ideal", name=cable.name, attachment_reference="joint")
        properties = ET.SubElement(item, "properties")
        ET.SubElement(properties, "force_min").text = repr(float(cable.lower or 0.0))
        ET.SubElement(properties, "force_max").text = repr(float(cable.upper or 0.0))
        attachments = ET.SubElement(item, "attachments")
        if cable.pulley_radius:  # CASPR divides by the radius
            assert cable.swivel_axis is not None
            _add_pulley(attachments, cable.exit_point, cable.pulley_radius, cable.swivel_axis)
        else:
            _add_attachment(attachments, 0, cable.exit_point)
        _add_attachment(attachments, 1, cable.anchor_point)
    return {"bodies": _document(system, "bodies_system", "bodies"),
            "cables": _document(root, "cables", "cables")}  # fmt: skip


def _angles_xyz(R: Array) -> Array:
    """Angles of R = Rx Ry Rz [rad]."""
    phi, theta, psi = RollPitchYaw(RotationMatrix(R.T)).vector()
    return -np.array([phi, theta, psi])


def write_tree(tree: CasprTree) -> dict[str, str]:
    """The files of a model, by their endings: bodies and cables.

    Points of cables are written from the joints of their links, moments of inertia about the
    centres of mass.
    """
    system = ET.Element("bodies_system")
    display = np.array([-1.0, 1.0] * 3) if tree.display is None else tree.display
    links = ET.SubElement(system, "links", display_range=_numbers(display), view_angle="-37 32")
    for number, link in enumerate(tree.links, 1):
        _link(links, number, link)
    root = ET.Element("cables", default_cable_set=CABLE_SET)
    cables = ET.SubElement(root, "cable_set", id=CABLE_SET)
    for cable in tree.cables:
        _cable(cables, cable)
    return {"bodies": _document(system, "bodies_system", "bodies"),
            "cables": _document(root, "cables", "cables")}  # fmt: skip


def _link(links: ET.Element, number: int, link: CasprLink) -> None:
    item = ET.SubElement(links, "link_rigid", num=str(number), name=link.name)
    joint = ET.SubElement(item, "joint", type=link.joint.kind)
    if link.joint.kind in AXIS_KINDS:
        joint.set("axis", _numbers(link.joint.steps[0].axis))
    if link.joint.actuated:
        joint.set("actuated", "true")
    joint.set("q_initial", _numbers(link.joint.initial))
    if link.joint.lower is not None and link.joint.upper is not None:
        joint.set("q_min", _numbers(link.joint.lower))
        joint.set("q_max", _numbers(link.joint.upper))
    physical = ET.SubElement(item, "physical")
    ET.SubElement(physical, "mass").text = repr(float(link.mass))
    ET.SubElement(physical, "com_location").text = _numbers(link.com)
    ET.SubElement(physical, "end_location").text = _numbers(link.end)
    _add_inertia(physical, link.inertia)
    parent = ET.SubElement(item, "parent")
    ET.SubElement(parent, "num").text = str(link.parent)
    ET.SubElement(parent, "location").text = _numbers(link.location)


def _cable(cables: ET.Element, cable: CasprCable) -> None:
    kind = "cable_ideal" if cable.stiffness is None else "cable_linear_spring"
    item = ET.SubElement(cables, kind, name=cable.name, attachment_reference="joint")
    properties = ET.SubElement(item, "properties")
    for key, value in (
        ("K", cable.stiffness), ("force_min", cable.lower), ("force_max", cable.upper),
        ("diameter", cable.diameter),
    ):  # fmt: skip
        if value is not None:
            ET.SubElement(properties, key).text = repr(float(value))
    attachments = ET.SubElement(item, "attachments")
    points = list(zip(cable.links, cable.points.T, strict=True))
    if cable.pulley_radius > 0.0:  # CASPR divides by the radius
        _add_pulley(attachments, points.pop(0)[1], cable.pulley_radius, cable.entry)
    for link, point in points:
        _add_attachment(attachments, link, point)


def _add_attachment(attachments: ET.Element, link: int, point: Array) -> None:
    """A point of a link that a cable runs through."""
    attachment = ET.SubElement(attachments, "attachment")
    ET.SubElement(attachment, "link").text = str(link)
    ET.SubElement(attachment, "location").text = _numbers(point)


def _add_pulley(attachments: ET.Element, point: Array, radius: float, entry: Array) -> None:
    """A pulley that swivels about the direction in which the cable comes to it."""
    pulley = ET.SubElement(attachments, "base_rotating_pulley")
    ET.SubElement(pulley, "fixed_location").text = _numbers(point)
    ET.SubElement(pulley, "pulley_radius").text = repr(float(radius))
    ET.SubElement(pulley, "cable_entry_vector").text = _numbers(entry)


def _add_inertia(physical: ET.Element, inertia: Array) -> None:
    """Moments and products about the centre of mass, shape (6,)."""
    item = ET.SubElement(physical, "inertia", ref="com")
    for key, value in zip(("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"), inertia, strict=True):
        ET.SubElement(item, key).text = repr(float(value))


def _numbers(values: object) -> str:
    """Numbers with spaces between them, to the last digit."""
    return " ".join(repr(float(value)) for value in np.asarray(values, float))


def _document(root: ET.Element, kind: str, template: str) -> str:
    """A file with its declarations."""
    ET.indent(root, "  ")
    head = f'<!DOCTYPE {kind} SYSTEM "../../../../templates/{template}.dtd">'
    body = ET.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{head}\n{body}\n'
