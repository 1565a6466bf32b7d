"""Elements that all of CASPR's model files have.

Source: github.com/darwinlau/CASPR, its model files and their templates.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from cdpr_drake.arrays import Array


def add_attachment(attachments: ET.Element, link: int, point: Array) -> None:
    """A point of a link that a cable runs through."""
    attachment = ET.SubElement(attachments, "attachment")
    ET.SubElement(attachment, "link").text = str(link)
    ET.SubElement(attachment, "location").text = xml_numbers(point)


def add_pulley(attachments: ET.Element, point: Array, radius: float, entry: Array) -> None:
    """A pulley that swivels about the direction in which the cable comes to it."""
    pulley = ET.SubElement(attachments, "base_rotating_pulley")
    ET.SubElement(pulley, "fixed_location").text = xml_numbers(point)
    ET.SubElement(pulley, "pulley_radius").text = repr(float(radius))
    ET.SubElement(pulley, "cable_entry_vector").text = xml_numbers(entry)


def add_inertia(physical: ET.Element, inertia: Array) -> None:
    """Moments and products about the centre of mass, shape (6,)."""
    item = ET.SubElement(physical, "inertia", ref="com")
    for key, value in zip(("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"), inertia, strict=True):
        ET.SubElement(item, key).text = repr(float(value))


def xml_numbers(values: object) -> str:
    """Numbers with spaces between them, to the last digit."""
    return " ".join(repr(float(value)) for value in np.asarray(values, float))


def document(root: ET.Element, kind: str, template: str) -> str:
    """A file with its declarations."""
    ET.indent(root, "  ")
    head = f'<!DOCTYPE {kind} SYSTEM "../../../../templates/{template}.dtd">'
    body = ET.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{head}\n{body}\n'
