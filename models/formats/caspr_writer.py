"""Writes robots as CASPR models: bodies and cables as XML files.

Source: github.com/darwinlau/CASPR, its model files and their templates.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
from pydrake.math import RollPitchYaw, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.models.formats.draft import DraftCable, RobotDraft


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
    links = ET.SubElement(system, "links", display_range=_words(corners), view_angle="-37 32")
    link = ET.SubElement(links, "link_rigid", num="1", name=draft.title or draft.name)
    ET.SubElement(
        link, "joint", type=joint, q_initial=_words(q), q_min=_words(low), q_max=_words(high)
    )
    physical = ET.SubElement(link, "physical")
    ET.SubElement(physical, "mass").text = repr(float(draft.mass or 0.0))
    ET.SubElement(physical, "com_location").text = _words(draft.center_of_mass)
    ET.SubElement(physical, "end_location").text = "0.0 0.0 0.0"
    inertia = ET.SubElement(physical, "inertia", ref="com")
    for key, value in zip(("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"), draft.inertia, strict=True):
        ET.SubElement(inertia, key).text = repr(float(value))
    parent = ET.SubElement(link, "parent")
    ET.SubElement(parent, "num").text = "0"
    ET.SubElement(parent, "location").text = _words(offset)
    root = ET.Element("cables", default_cable_set="original")
    cables = ET.SubElement(root, "cable_set", id="original")
    for cable in draft.cables:
        item = ET.SubElement(cables, "cable_ideal", name=cable.name, attachment_reference="joint")
        properties = ET.SubElement(item, "properties")
        ET.SubElement(properties, "force_min").text = repr(float(cable.lower or 0.0))
        ET.SubElement(properties, "force_max").text = repr(float(cable.upper or 0.0))
        attachments = ET.SubElement(item, "attachments")
        if cable.pulley_radius:  # CASPR divides by the radius
            _pulley(attachments, cable)
        else:
            _attachment(attachments, 0, cable.exit_point)
        _attachment(attachments, 1, cable.anchor_point)
    return {"bodies": _document(system, "bodies_system", "bodies"),
            "cables": _document(root, "cables", "cables")}  # fmt: skip


def _attachment(attachments: ET.Element, link: int, point: Array) -> None:
    attachment = ET.SubElement(attachments, "attachment")
    ET.SubElement(attachment, "link").text = str(link)
    ET.SubElement(attachment, "location").text = _words(point)


def _pulley(attachments: ET.Element, cable: DraftCable) -> None:
    """A pulley that swivels about the direction in which the cable comes to it."""
    assert cable.swivel_axis is not None
    pulley = ET.SubElement(attachments, "base_rotating_pulley")
    ET.SubElement(pulley, "fixed_location").text = _words(cable.exit_point)
    ET.SubElement(pulley, "pulley_radius").text = repr(float(cable.pulley_radius or 0.0))
    ET.SubElement(pulley, "cable_entry_vector").text = _words(cable.swivel_axis)


def _angles_xyz(R: Array) -> Array:
    """Angles of R = Rx Ry Rz [rad]."""
    phi, theta, psi = RollPitchYaw(RotationMatrix(R.T)).vector()
    return -np.array([phi, theta, psi])


def _words(values: object) -> str:
    return " ".join(repr(float(value)) for value in np.asarray(values, float))


def _document(root: ET.Element, kind: str, template: str) -> str:
    ET.indent(root, "  ")
    head = f'<!DOCTYPE {kind} SYSTEM "../../../../templates/{template}.dtd">'
    body = ET.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{head}\n{body}\n'
