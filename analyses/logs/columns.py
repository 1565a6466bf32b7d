"""Quantities and units in the headers of logs: the one table of names that all readers use.

A header is a name with a unit behind it, after _ or in brackets: `C1_length_mm`, `tension 3 [kN]`.
What is known gets a name with its SI unit, such as `C1_length_m`. A new word, unit or quantity is
one entry here, and every command that reads logs knows it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

UNITS = {
    "s": ("time", 1.0), "ms": ("time", 1e-3), "us": ("time", 1e-6), "ns": ("time", 1e-9),
    "m": ("length", 1.0), "mm": ("length", 1e-3), "cm": ("length", 1e-2), "um": ("length", 1e-6),
    "in": ("length", 0.0254), "inch": ("length", 0.0254), "ft": ("length", 0.3048),
    "rad": ("angle", 1.0), "deg": ("angle", np.pi / 180.0), "mrad": ("angle", 1e-3),
    "n": ("force", 1.0), "kn": ("force", 1e3), "kgf": ("force", 9.80665),
    "lbf": ("force", 4.4482216152605), "nm": ("torque", 1.0), "mnm": ("torque", 1e-3),
    "px": ("image", 1.0), "pix": ("image", 1.0), "pixel": ("image", 1.0),
}  # fmt: skip
"""Dimension and SI factor of each unit that a header may end in."""

SI = {"length": "m", "angle": "rad", "force": "n", "time": "s", "torque": "nm", "image": "px"}
"""Units that names end in, by dimension."""

SHOWN = {"n": "N", "nm": "N m"}
"""Units of names that are written otherwise in words."""

TIME, LENGTHS, ANGLES, SWIVELS, TENSIONS, TORQUES = (
    "time", "cable lengths", "motor angles", "swivel angles", "tensions", "motor torques",
)  # fmt: skip
POSITION, QUATERNION, TAIT, TURN, RPY = "position", "quaternion", "angles", "turn", "rpy"
CORNERS, MARKERS = "tag corners", "markers"
"""Kinds of quantities."""

SECONDS = "time_s"
LENGTH, MOTOR, SWIVEL, TENSION = "length_m", "motor_angle_rad", "swivel_rad", "tension_n"
"""Ends of the names of what is measured of cables."""

CABLE_QUANTITIES = {
    LENGTHS: (LENGTH, "length l len cablelength lengths deltalength dl unstrainedlength "
              "measuredlength unstrainedlengths measuredlengths cablelengths"),
    ANGLES: (MOTOR, "motorangle motor encoder drumangle q motorangles"),
    SWIVELS: (SWIVEL, "swivel swivelangle sigma swivelangles"),
    TORQUES: ("torque_nm", "torque torques motortorque motortorques appliedtorque appliedtorques "
              "drivetorque"),
    TENSIONS: (TENSION, "tension force f tau loadcell measuredtension tensions measuredtensions"),
}  # fmt: skip
"""End of the name, and words in headers, of each kind that is measured of cables."""

PARTS = {
    POSITION: ("x_m", "y_m", "z_m"), QUATERNION: ("qw", "qx", "qy", "qz"),
    TAIT: ("phi_rad", "theta_rad", "psi_rad"), TURN: ("rx_rad", "ry_rad", "rz_rad"),
    RPY: ("roll_rad", "pitch_rad", "yaw_rad"),
}  # fmt: skip
"""Names of the parts of a pose."""

ROTATIONS = (QUATERNION, TAIT, TURN, RPY)
"""Kinds that a rotation may have; the first one of a log counts."""

COMMANDED, ESTIMATED = "commanded_", "estimated_"
"""Before a name: a command to the machine, and an estimate of its controller."""

MOST_CABLES = 32
"""Cables without names: C1, C2, ..."""

_TIMES = ("t", "time", "timestamp", "stamp")
_PREFIXES = ("orientation", "platform", "tracker", "tracked", "measured", "position", "mocap",
             "pose", "body", "xwp", "pos", "rot", "p")  # fmt: skip
_PART_WORDS = {
    re.sub("_(m|rad)$", "", name): (name, kind) for kind, names in PARTS.items() for name in names
}
_NAMED = re.compile(
    r"(?P<a>[a-z]{1,2}\d{0,2})[_. ](?:{0})|(?:{0})[_. ](?P<b>[a-z]{1,2}\d{0,2})".replace(
        "{0}", "(?:measured_)?(?:length|tension|force|swivel(?:_angle)?|torque|motor(?:_angle)?"
        "|encoder|drum_angle)"
    )
)  # fmt: skip
_NO_NAMES = {"x", "y", "z", "t", "mx", "my", "mz", "fx", "fy", "fz", "id", "dt"}
"""Letters in headers that are no names of cables: force_x is a part of a vector."""


class Column(NamedTuple):
    """Meaning of a header.

    Attributes:
        name: Name with the SI unit.
        kind: `TIME`, `LENGTHS` and the like; `commanded` or `estimated` with these prefixes.
        unit: Unit of the header; empty: it names none.
        factor: Factor from the header's unit to SI.
    """

    name: str
    kind: str
    unit: str
    factor: float

    @property
    def dimension(self) -> str:
        """Dimension of the quantity; empty for pure numbers."""
        return next((key for key, si in SI.items() if self.name.endswith(f"_{si}")), "")


def split_unit(header: str) -> tuple[str, str]:
    """A header in small letters without its unit, and the unit, empty if there is none."""
    words = header.strip().lower().replace("\N{MICRO SIGN}", "u").replace("\N{DEGREE SIGN}", "deg")
    bracket = re.fullmatch(r"(.*?)[\s_/]*[\[(]\s*([a-z]+)\s*[\])]", words)
    if bracket and bracket[2] in UNITS:
        return bracket[1], bracket[2]
    stem, mark, last = words.rpartition("_") if "_" in words else words.rpartition(" ")
    return (stem, last) if mark and last in UNITS else (words, "")


def read_header(header: str, cables: Sequence[str], first: int = 1) -> Column | None:
    """Meaning of a header; None if it is none of the quantities above.

    Args:
        header: The header as it stands in the file.
        cables: Names of the cables.
        first: Number of the first cable where numbers stand for names, 0 or 1.
    """
    prefix = _prefix(header)
    words, unit = split_unit(header[len(prefix) :])
    marker = re.fullmatch(r"marker_(\w+)_([xyz])", words)
    if marker:
        end = marker.end(1)
        return Column(f"{header[:end]}_{marker[2]}_m", MARKERS, unit, UNITS.get(unit, ("", 1.0))[1])
    quantity = _quantity(words, re.sub(r"[^a-z0-9]", "", words), cables, first)
    if quantity is None:
        return None
    name, kind = quantity
    column = Column(prefix + name, prefix.rstrip("_") or kind, unit, 1.0)
    dimension, factor = UNITS.get(unit, ("", 1.0))
    # A unit of another dimension is no unit: tau_n is a tension, q_m an angle of a motor.
    return column._replace(factor=factor) if dimension == column.dimension else column


def _quantity(words: str, plain: str, cables: Sequence[str], first: int) -> tuple[str, str] | None:
    if plain in _TIMES:
        return SECONDS, TIME
    tag = re.fullmatch(r"(?:tag|marker)_?(\d+)_?(?:corner)?_?([uv])_?([1-4])", words)
    if tag:
        return f"tag{int(tag[1])}_{tag[2]}{tag[3]}_px", CORNERS
    for prefix in ("", *_PREFIXES):
        if plain.startswith(prefix) and plain[len(prefix) :] in _PART_WORDS:
            return _PART_WORDS[plain[len(prefix) :]]
    for k, cable in enumerate(cables):
        for alias in (cable.lower(), f"cable{k + first}", str(k + first)):
            bare = re.sub(r"[^a-z0-9]", "", alias)
            rest = plain.removeprefix(bare)
            rest = plain.removesuffix(bare) if rest == plain else rest
            for kind, (ending, known) in CABLE_QUANTITIES.items():
                if rest != plain and rest in known.split():
                    return f"{cable}_{ending}", kind
    return None


def _prefix(header: str) -> str:
    return next((p for p in (COMMANDED, ESTIMATED) if header.lower().startswith(p)), "")


def cable_names(headers: Sequence[str]) -> list[str]:
    """Names of cables in headers such as tl_length_mm or motor_A_deg: at most two letters and a
    number; none where there is one name only."""
    names: dict[str, None] = {}
    for header in headers:
        bare = header[len(_prefix(header)) :]
        match = _NAMED.fullmatch(split_unit(bare)[0])
        group = "b" if match and match["b"] else "a"
        if match and match[group] not in _NO_NAMES:
            names[bare[match.start(group) : match.end(group)]] = None
    return list(names) if len(names) > 1 else []


def preference(header: str) -> int:
    """Rank of a column among those of one quantity: measured, counted by winches, others.

    A simulation logs true values beside measured ones.
    """
    words = split_unit(header)[0]
    return 2 if "measured" in words else 1 if "unstrained" in words else 0


def first_number(headers: Sequence[str], count: int) -> int:
    """0 if cables are counted from 0: there is a 0, and none has the number `count`; else 1."""
    known = "|".join(word for _, words in CABLE_QUANTITIES.values() for word in words.split())
    numbered = rf"(?:cable)?(?:{known})(?:cable)?(\d+)|cable(\d+)(?:{known})"
    plain = [re.sub(r"[^a-z0-9]", "", split_unit(header)[0]) for header in headers]
    numbers = {int(m[1] or m[2]) for words in plain if (m := re.fullmatch(numbered, words))}
    return 0 if 0 in numbers and count not in numbers else 1


def unknown_unit(header: str, cables: Sequence[str], first: int) -> str:
    """The last word of a header that would be known without it; empty if there is none."""
    stem, mark, last = re.sub(r"[\[\]()]", " ", header).strip().replace(" ", "_").rpartition("_")
    known = mark and last.isalpha() and read_header(stem, cables, first) is not None
    return last if known else ""
