"""What the columns of a log of measurements are, by their headers and units."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

UNITS = {
    "s": ("time", 1.0), "ms": ("time", 1e-3), "us": ("time", 1e-6),
    "m": ("length", 1.0), "mm": ("length", 1e-3), "cm": ("length", 1e-2), "um": ("length", 1e-6),
    "rad": ("angle", 1.0), "deg": ("angle", np.pi / 180.0), "mrad": ("angle", 1e-3),
    "n": ("force", 1.0), "kn": ("force", 1e3), "nm": ("torque", 1.0), "mnm": ("torque", 1e-3),
    "px": ("image", 1.0), "pix": ("image", 1.0), "pixel": ("image", 1.0),
}  # fmt: skip
"""Units that a header may end in, in brackets or after _ or a blank, with their dimension."""

TIME, LENGTHS, ANGLES, SWIVELS, TENSIONS = (
    "time", "cable lengths", "motor angles", "swivel angles", "tensions",
)  # fmt: skip
POSITION, QUATERNION, TAIT, TURN, RPY = "position", "quaternion", "angles", "turn", "rpy"
CORNERS, TORQUES = "tag corners", "motor torques"

_CABLE_WORDS = {
    LENGTHS: ("length", "l", "len", "cablelength", "lengths", "deltalength", "dl",
              "unstrainedlength", "measuredlength", "unstrainedlengths", "measuredlengths",
              "cablelengths"),
    ANGLES: ("motorangle", "motor", "encoder", "drumangle", "q", "motorangles"),
    SWIVELS: ("swivel", "swivelangle", "sigma", "swivelangles"),
    TORQUES: ("torque", "torques", "motortorque", "motortorques", "appliedtorque",
              "appliedtorques", "drivetorque"),
    TENSIONS: ("tension", "force", "f", "tau", "loadcell", "measuredtension", "tensions",
               "measuredtensions"),
}  # fmt: skip
_DIMENSIONS = {
    LENGTHS: "length",
    ANGLES: "angle",
    SWIVELS: "angle",
    TENSIONS: "force",
    TORQUES: "torque",
}
_TIMES = ("t", "time", "timestamp", "stamp")
_PREFIXES = ("pose", "platform", "tracker", "tracked", "mocap", "measured", "body", "xwp", "p",
             "pos", "position", "rot", "orientation")  # fmt: skip
_PARTS = {
    **{name: (POSITION, k, "length") for k, name in enumerate("xyz")},
    **{name: (QUATERNION, k, "") for k, name in enumerate(("qw", "qx", "qy", "qz"))},
    **{name: (TAIT, k, "angle") for k, name in enumerate(("phi", "theta", "psi"))},
    **{name: (TURN, k, "angle") for k, name in enumerate(("rx", "ry", "rz"))},
    **{name: (RPY, k, "angle") for k, name in enumerate(("roll", "pitch", "yaw"))},
}


class Column(NamedTuple):
    """What a column holds.

    Attributes:
        what: `TIME`, `LENGTHS` and the like.
        key: Cable from 0, part of a pose, or (tag, corner, u or v).
        factor: By which its numbers become SI.
    """

    what: str
    key: int | tuple[int, int, int]
    factor: float


def read_header(header: str, cables: Sequence[str], first: int) -> Column | None:
    """What a column is, or None where it is none of those that a calibration knows.

    Args:
        header: As it stands in the file.
        cables: Names of the cables.
        first: Number of the first cable where numbers stand for names, 0 or 1.
    """
    words, unit = split_unit(header)
    plain = re.sub(r"[^a-z0-9]", "", words)
    if plain in _TIMES:
        return Column(TIME, 0, _factor(unit, "time"))
    tag = re.fullmatch(r"(?:tag|marker)_?(\d+)_?(?:corner)?_?([uv])_?([1-4])", words)
    if tag:
        key = (int(tag[1]), int(tag[3]) - 1, "uv".index(tag[2]))
        return Column(CORNERS, key, _factor(unit, "image"))
    part = _pose_part(words, plain)
    if part is not None:
        what, k, dimension = part
        return Column(what, k, _factor(unit, dimension) if dimension else 1.0)
    for i, name in enumerate(cables):
        for alias in (name.lower(), f"cable{i + first}", str(i + first)):
            for what, known in _CABLE_WORDS.items():
                rest = _without(plain, re.sub(r"[^a-z0-9]", "", alias))
                if rest is not None and rest in known:
                    return Column(what, i, _factor(unit, _DIMENSIONS[what]))
    return None


def preference(header: str) -> int:
    """Which of two columns of one thing is read: what was measured, what winches count, the rest.

    A simulation logs what is true beside what is measured.
    """
    plain = re.sub(r"[^a-z0-9]", "", split_unit(header)[0])
    return 2 if "measured" in plain else 1 if "unstrained" in plain else 0


def first_number(headers: Sequence[str], count: int) -> int:
    """0 where cables are counted from 0: there is a 0 and none with the number of all, else 1."""
    numbers = set()
    for header in headers:
        plain = re.sub(r"[^a-z0-9]", "", split_unit(header)[0])
        for known in _CABLE_WORDS.values():
            for word in known:
                found = re.fullmatch(rf"(?:cable)?{word}(?:cable)?(\d+)|cable(\d+){word}", plain)
                if found:
                    numbers.add(int(found[1] or found[2]))
    return 0 if 0 in numbers and count not in numbers else 1


def split_unit(header: str) -> tuple[str, str]:
    """A header in small letters without its unit, and the unit, empty where it has none."""
    words = header.strip().lower().replace("\N{MICRO SIGN}", "u").replace("\N{DEGREE SIGN}", "deg")
    found = re.fullmatch(r"(.*?)[\s_/]*[\[(]\s*([a-z]+)\s*[\])]", words)
    if found and found[2] in UNITS:
        return found[1], found[2]
    stem, mark, last = words.rpartition("_") if "_" in words else words.rpartition(" ")
    if mark and last in UNITS:
        return stem, last
    return words, ""


def _factor(unit: str, dimension: str) -> float:
    """Of a unit; 1 where it has none, or one of another dimension, which is then no unit."""
    found = UNITS.get(unit)
    return found[1] if found is not None and found[0] == dimension else 1.0


def _pose_part(words: str, plain: str) -> tuple[str, int, str] | None:
    if plain in _PARTS:
        return _PARTS[plain]
    for prefix in sorted(_PREFIXES, key=len, reverse=True):
        rest = plain.removeprefix(prefix)
        if rest != plain and rest in _PARTS:
            return _PARTS[rest]
    return None


def _without(plain: str, alias: str) -> str | None:
    """What is left of a word without a cable's name before or behind it."""
    if plain.startswith(alias):
        return plain[len(alias) :]
    if plain.endswith(alias):
        return plain[: -len(alias)]
    return None
