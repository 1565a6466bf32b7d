"""Writes trees of links and their cables as CASPR models: bodies and cables as XML files.

Source: github.com/darwinlau/CASPR, its model files and their templates.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from cdpr_drake.formats.caspr_trees import AXIS_KINDS, CasprCable, CasprLink, CasprTree
from cdpr_drake.formats.caspr_xml import (
    add_attachment,
    add_inertia,
    add_pulley,
    document,
    xml_numbers,
)

CABLE_SET = "original"
"""Name of the one set of cables that is written."""


def write_tree(tree: CasprTree) -> dict[str, str]:
    """The files of a model, by their endings: bodies and cables.

    Points of cables are written from the joints of their links, moments of inertia about the
    centres of mass.
    """
    system = ET.Element("bodies_system")
    display = np.array([-1.0, 1.0] * 3) if tree.display is None else tree.display
    links = ET.SubElement(system, "links", display_range=xml_numbers(display), view_angle="-37 32")
    for number, link in enumerate(tree.links, 1):
        _link(links, number, link)
    root = ET.Element("cables", default_cable_set=CABLE_SET)
    cables = ET.SubElement(root, "cable_set", id=CABLE_SET)
    for cable in tree.cables:
        _cable(cables, cable)
    return {"bodies": document(system, "bodies_system", "bodies"),
            "cables": document(root, "cables", "cables")}  # fmt: skip


def _link(links: ET.Element, number: int, link: CasprLink) -> None:
    item = ET.SubElement(links, "link_rigid", num=str(number), name=link.name)
    joint = ET.SubElement(item, "joint", type=link.joint.kind)
    if link.joint.kind in AXIS_KINDS:
        joint.set("axis", xml_numbers(link.joint.steps[0].axis))
    if link.joint.actuated:
        joint.set("actuated", "true")
    joint.set("q_initial", xml_numbers(link.joint.initial))
    if link.joint.lower is not None and link.joint.upper is not None:
        joint.set("q_min", xml_numbers(link.joint.lower))
        joint.set("q_max", xml_numbers(link.joint.upper))
    physical = ET.SubElement(item, "physical")
    ET.SubElement(physical, "mass").text = repr(float(link.mass))
    ET.SubElement(physical, "com_location").text = xml_numbers(link.com)
    ET.SubElement(physical, "end_location").text = xml_numbers(link.end)
    add_inertia(physical, link.inertia)
    parent = ET.SubElement(item, "parent")
    ET.SubElement(parent, "num").text = str(link.parent)
    ET.SubElement(parent, "location").text = xml_numbers(link.location)


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
        add_pulley(attachments, points.pop(0)[1], cable.pulley_radius, cable.entry)
    for link, point in points:
        add_attachment(attachments, link, point)
