"""Pulleys at the base ends of CASPR's cables, and names of its cables.

`base_rotating_pulley` is a pulley that swivels about the direction in which the cable comes to it.
`screw_base_rotating_pulley` is the same on a carriage that travels along the winch while the cable
is wound: its place is that of an encoder, which no file gives.

Source: github.com/darwinlau/CASPR, src/Model/Cables/CableAttachments.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.models.foreign_text import child_text, fail, number, numbers

PULLEYS = {
    "base_rotating_pulley": ("fixed_location", "cable_entry_vector"),
    "screw_base_rotating_pulley": ("constant_winch_point", "cable_pulley_entry_vector"),
}
"""Elements of pulleys, with those of their point and of the direction in which the cable comes."""


_TRAVELS = (
    "Pulleys travel along their winches, from places that the file does not give; they were put at "
    "constant_winch_point and stay there."
)


@dataclass(frozen=True, eq=False)
class BasePulley:
    """A pulley at the base end of a cable.

    Attributes:
        point: Where the cable comes to the groove, in W, shape (3,) [m].
        radius: Radius of the groove [m].
        entry: Direction in which it comes, in W, of length 1, shape (3,).
    """

    point: Array
    radius: float
    entry: Array


def read_pulley(path: Path, item: ET.Element, where: str, remarks: list[str]) -> BasePulley:
    """Reads an element of `PULLEYS`.

    Args:
        path: The file.
        item: The element.
        where: Cable and attachment, for messages.
        remarks: Gets what was not kept.

    Raises:
        RobotFileError: A number is not accepted.
    """
    place, direction = PULLEYS[item.tag]
    point = triple(path, item, place, where)
    words = child_text(path, item, "pulley_radius", f"{where}, pulley_radius")
    radius = number(path, f"{where}, pulley_radius", words)
    entry = triple(path, item, direction, where)
    if radius < 0.0 or not np.any(entry):
        raise fail(path, where, f"radius {radius:g}, entry vector {entry.tolist()}",
                   "a radius of at least 0 [m], a vector that is not zero")  # fmt: skip
    if item.tag != "base_rotating_pulley" and _TRAVELS not in remarks:
        remarks.append(_TRAVELS)
    return BasePulley(point, radius, entry / np.linalg.norm(entry))


def triple(path: Path, parent: ET.Element, name: str, where: str) -> Array:
    """Three numbers of a child element, shape (3,).

    Raises:
        RobotFileError: There are no such three.
    """
    return numbers(path, f"{where}, {name}", child_text(path, parent, name, f"{where}, {name}"), 3)


def short_name(name: str) -> str:
    """What a cable is called here that CASPR's users numbered, `C7` for `cable 7` or `7`."""
    short = re.sub(r"^cable[ _]*(?=\d+$)", "C", name, flags=re.IGNORECASE)
    return f"C{short}" if short.isdigit() else short
