"""Writes robots as CASPR models: bodies and cables as XML files.

Source: github.com/darwinlau/CASPR, its model files and their templates.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
from pydrake.math import RollPitchYaw, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.formats.caspr_xml import (
    add_attachment,
    add_inertia,
    add_pulley,
    document,
    xml_numbers,
)
from cdpr_drake.formats.draft import RobotDraft


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
    links = ET.SubElement(system, "links", display_range=xml_numbers(corners), view_angle="-37 32")
    link = ET.SubElement(links, "link_rigid", num="1", name=draft.title or draft.name)
    ET.SubElement(
        link,
        "joint",
        type=joint,
        q_initial=xml_numbers(q),
        q_min=xml_numbers(low),
        q_max=xml_numbers(high),
    )
    physical = ET.SubElement(link, "physical")
    ET.SubElement(physical, "mass").text = repr(float(draft.mass or 0.0))
    ET.SubElement(physical, "com_location").text = xml_numbers(draft.center_of_mass)
    ET.SubElement(physical, "end_location").text = "0.0 0.0 0.0"
    add_inertia(physical, draft.inertia)
    parent = ET.SubElement(link, "parent")
    ET.SubElement(parent, "num").text = "0"
    ET.SubElement(parent, "location").text = xml_numbers(offset)
    root = ET.Element("cables", default_cable_set="original")
    cables = ET.SubElement(root, "cable_set", id="original")
    for cable in draft.cables:
        item = ET.SubElement(cables, "cable_ideal", name=cable.name, attachment_reference="joint")
        properties = ET.SubElement(item, "properties")
        ET.SubElement(properties, "force_min").text = repr(float(cable.lower or 0.0))
        ET.SubElement(properties, "force_max").text = repr(float(cable.upper or 0.0))
        attachments = ET.SubElement(item, "attachments")
        if cable.pulley_radius:  # CASPR divides by the radius
            assert cable.swivel_axis is not None
            add_pulley(attachments, cable.exit_point, cable.pulley_radius, cable.swivel_axis)
        else:
            add_attachment(attachments, 0, cable.exit_point)
        add_attachment(attachments, 1, cable.anchor_point)
    return {"bodies": document(system, "bodies_system", "bodies"),
            "cables": document(root, "cables", "cables")}  # fmt: skip


def _angles_xyz(R: Array) -> Array:
    """Angles of R = Rx Ry Rz [rad]."""
    phi, theta, psi = RollPitchYaw(RotationMatrix(R.T)).vector()
    return -np.array([phi, theta, psi])
