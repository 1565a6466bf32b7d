"""What may be unknown of a robot, as one vector with names and units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CalibrationError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import rotation_from_vector, rotation_vector


@dataclass(frozen=True)
class ParameterGroup:
    """Parameters of one kind.

    Attributes:
        single: Name of one of them.
        words: What one is, in words.
        parts: What one consists of; empty for a number.
        units: Unit of each part.
        typical: By how much each part is usually unknown, in its unit: makes metres, radians and
            ratios comparable.
        owner: Who has one: "cable", "tag" or "robot".
    """

    single: str
    words: str
    parts: tuple[str, ...]
    units: tuple[str, ...]
    typical: tuple[float, ...]
    owner: str = "cable"


_XYZ, _TURNS = ("x", "y", "z"), ("rx", "ry", "rz")
_POSE = (*_TURNS, *_XYZ), (*["rad"] * 3, *["m"] * 3), (*[0.05] * 3, *[0.01] * 3)

GROUPS = {
    "exit_points": ParameterGroup("exit_point", "exit point", _XYZ, ("m",) * 3, (0.01,) * 3),
    "anchor_points": ParameterGroup("anchor_point", "anchor point", _XYZ, ("m",) * 3, (0.01,) * 3),
    "length_offsets": ParameterGroup("length_offset", "length offset", (), ("m",), (0.01,)),
    "length_scales": ParameterGroup("length_scale", "drum radius", (), ("-",), (0.01,)),
    "pulley_radii": ParameterGroup("pulley_radius", "pulley radius", (), ("m",), (0.01,)),
    "swivel_offsets": ParameterGroup("swivel_offset", "swivel angle's zero", (), ("rad",), (0.05,)),
    "camera": ParameterGroup("camera", "camera", *_POSE, "robot"),
    "tags": ParameterGroup("pose", "pose", *_POSE, "tag"),
    "tracker": ParameterGroup("tracker", "tracker's frame", *_POSE, "robot"),
    "marker": ParameterGroup("marker", "tracker's marker", *_POSE, "robot"),
    "drum_radii": ParameterGroup("drum_radius", "drum's radius", (), ("m",), (0.001,)),
    "common_drum_radius": ParameterGroup(
        "common_drum_radius", "radius of all drums", (), ("m",), (0.001,), "robot"
    ),
    "tilt_zeros": ParameterGroup(
        "tilt_zero", "tilt's zero", ("roll", "pitch", "yaw"), ("rad",) * 3, (0.05,) * 3, "robot"
    ),
    "clock": ParameterGroup("clock", "tracker's clock", (), ("s",), (0.01,), "robot"),
    "common_length_offset": ParameterGroup(
        "common_length_offset", "offset of all lengths", (), ("m",), (0.01,), "robot"
    ),
    "common_length_scale": ParameterGroup(
        "common_length_scale", "stretch of all lengths", (), ("-",), (0.01,), "robot"
    ),
}
"""Kinds of parameters in the order of the vector.

`length_scales` are drum radii over those of the robot's file: cable that is counted times the scale
is cable that is paid out. `drum_radii` are by how much each drum is larger, beside
`common_drum_radius` of all; with layers on a drum these turn motor angles into lengths otherwise
than a scale. `common_length_scale` multiplies all readings, from zero on, and
`common_length_offset` is added to all lengths: one tape or one encoder's scale. `clock` is by how
much a tracker is late. Turns (rx, ry, rz) of the camera and of a tracker's marker are about the
axes of P, of tags and of the tracker's frame about those of W."""

OF_CABLES = {"exit_points": "p_WA", "anchor_points": "p_PB", "pulley_radii": "pulley_radius"}
OWN_FIELDS = {"camera": "X_PC", "tags": "tags", "tracker": "X_WK", "marker": "X_PM"}
"""Fields of groups in the cables of a model, and in itself where they are not `single`."""

POSE_GROUPS = tuple(key for key, group in GROUPS.items() if group.parts == _POSE[0])
"""Groups whose members are poses: turns, which do not add up, then translations."""


@dataclass(frozen=True, eq=False)
class CalibrationModel:
    """All that a calibration may find out, as it is believed now.

    Attributes:
        names: Of the cables.
        cables: The cables: exit and anchor points, pulleys.
        X_PC: Camera on the platform [m].
        tags: Poses X_WT of the tags by their number [m].
        length_offset: Length beyond that of the reading where counting began, shape (m,) [m].
        length_scale: Drum radius over that which readings were counted by, shape (m,) [-].
        swivel_offset: Angle about the swivel axis where a reading is zero, shape (m,) [rad].
        X_WK: Frame K in which a tracker tells poses [m].
        X_PM: Marker body M on the platform, whose pose a tracker tells [m].
        drum_radius: By how much each drum is larger than in the robot's file, shape (m,) [m].
        common_drum_radius: By how much all of them are larger, besides [m].
        tilt_zero: Roll, pitch and yaw at which a tilt sensor reads zero, shape (3,) [rad].
        clock: By how much a tracker is late [s].
        common_length_offset: Further part of all length offsets [m].
        common_length_scale: Factor of all readings of lengths, from zero on [-].
    """

    names: tuple[str, ...]
    cables: CableSet
    X_PC: RigidTransform = field(default_factory=RigidTransform)
    tags: dict[int, RigidTransform] = field(default_factory=dict)
    length_offset: Array = field(default_factory=lambda: np.zeros(0))
    length_scale: Array = field(default_factory=lambda: np.ones(0))
    swivel_offset: Array = field(default_factory=lambda: np.zeros(0))
    X_WK: RigidTransform = field(default_factory=RigidTransform)
    X_PM: RigidTransform = field(default_factory=RigidTransform)
    drum_radius: Array = field(default_factory=lambda: np.zeros(0))
    common_drum_radius: float = 0.0
    tilt_zero: Array = field(default_factory=lambda: np.zeros(3))
    clock: float = 0.0
    common_length_offset: float = 0.0
    common_length_scale: float = 1.0

    def __post_init__(self) -> None:
        """Fills in what was left out.

        Raises:
            CalibrationError: There is not one name, offset and scale for each cable, or a cable has
                a pulley at the platform.
        """
        m = self.cables.count
        for name, value in (
            ("length_offset", 0.0), ("length_scale", 1.0), ("swivel_offset", 0.0),
            ("drum_radius", 0.0),
        ):  # fmt: skip
            if np.size(getattr(self, name)) == 0:
                object.__setattr__(self, name, np.full(m, value))
            found = np.shape(getattr(self, name))
            if found != (m,):
                raise CalibrationError(f"{name}: found shape {found}; accepted: ({m},)")
        if len(self.names) != m:
            raise CalibrationError(f"names: found {len(self.names)}; accepted: {m} names of cables")
        if self.cables.has_platform_pulleys():
            i = int(np.argmax(self.cables.anchor_pulley_radius > 0.0))
            raise CalibrationError(
                f"cable {self.names[i]}: found a pulley at the platform; accepted: anchor points "
                "that are fixed there, since residuals know pulleys at the frame only"
            )

    def owners(self, group: ParameterGroup) -> list[str]:
        """Who has a parameter of a group, by name."""
        if group.owner == "cable":
            return list(self.names)
        return [f"tag{tag}" for tag in self.tags] if group.owner == "tag" else [""]


@dataclass(frozen=True, eq=False)
class ParameterLayout:
    """The vector of all parameters of a model.

    Attributes:
        names: Such as C3.exit_point.z, camera.rx or tag5.pose.y.
        units: Of each.
        typical: By how much each is usually unknown, shape (n,).
        words: Each in words.
        slices: Where each group stands.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    typical: Array
    words: tuple[str, ...]
    slices: dict[str, slice]

    @property
    def size(self) -> int:
        """Number of parameters n."""
        return len(self.names)

    def pose_starts(self) -> list[int]:
        """Where each pose begins in the vector: three turns, then three translations."""
        return [
            begin
            for key in POSE_GROUPS
            for begin in range(self.slices[key].start, self.slices[key].stop, 6)
        ]

    def select(self, patterns: Sequence[str]) -> npt.NDArray[np.bool_]:
        """Which parameters are meant, shape (n,).

        Args:
            patterns: Names of groups, or of parameters with * and ?, as C3.* or *.exit_point.z.

        Raises:
            CalibrationError: A pattern means none.
        """
        chosen = np.zeros(self.size, dtype=bool)
        for pattern in patterns:
            mine = np.zeros(self.size, dtype=bool)
            if pattern in self.slices:
                mine[self.slices[pattern]] = True
            else:
                mine[:] = [fnmatchcase(name, pattern) for name in self.names]
            if not mine.any():
                why = " (no tag is in view)" if pattern == "tags" else ""
                raise CalibrationError(
                    f"unknown: found {pattern!r}{why}; accepted: {', '.join(GROUPS)}, or names "
                    f"such as {self.names[0]}, also with * and ?"
                )
            chosen |= mine
        return chosen


def parameter_layout(model: CalibrationModel) -> ParameterLayout:
    """The vector of all parameters that a model has, with names, units and sizes."""
    names: list[str] = []
    units: list[str] = []
    words: list[str] = []
    typical: list[float] = []
    slices = {}
    for key, group in GROUPS.items():
        begin = len(names)
        for owner in model.owners(group):
            who = f"{owner}'s {group.words}" if owner else f"the {group.words}"
            stem = ".".join(part for part in (owner, group.single) if part)
            for part in group.parts or ("",):
                names.append(f"{stem}.{part}" if part else stem)
                words.append(_in_words(who, part))
        count = len(model.owners(group))
        units += group.units * count
        typical += group.typical * count
        slices[key] = slice(begin, len(names))
    return ParameterLayout(tuple(names), tuple(units), np.array(typical), tuple(words), slices)


def _in_words(who: str, part: str) -> str:
    if part in _TURNS:
        return f"{who} about {part[1]}"
    if part not in _XYZ:
        return f"{who} in {part}" if part else who
    return f"{who} along {part}"


def moved_model(
    model: CalibrationModel, step: Array, layout: ParameterLayout | None = None
) -> CalibrationModel:
    """A model after a step of all parameters, shape (n,); poses turn about the axes they stand in.

    Raises:
        CableModelError: A pulley's radius would be negative.
    """
    at = (layout or parameter_layout(model)).slices
    of_cables: dict[str, Any] = {}
    own: dict[str, Any] = {}
    for key, part in ((key, step[where]) for key, where in at.items()):
        value: Any = _value(model, key)
        if key == "tags":
            twists = part.reshape(-1, 6)
            value = {tag: turned(X, t) for (tag, X), t in zip(value.items(), twists, strict=True)}
        elif key in POSE_GROUPS:
            value = turned(value, part)
        elif isinstance(value, float):
            value += float(part[0])
        else:
            value = value + (part.reshape(-1, 3).T if value.ndim == 2 else part)
        (of_cables if key in OF_CABLES else own)[_field(key)] = value
    return replace(model, cables=replace(model.cables, **of_cables), **own)


def _field(key: str) -> str:
    """Name of a group's values in a model, or in its cables."""
    return OF_CABLES.get(key) or OWN_FIELDS.get(key) or GROUPS[key].single


def _value(model: CalibrationModel, key: str) -> Any:
    return getattr(model.cables if key in OF_CABLES else model, _field(key))


def moved_frames(model: CalibrationModel, twists: Array) -> CalibrationModel:
    """A model whose world and platform frames moved: each turned, then moved along its axes.

    Args:
        model: The model.
        twists: Turn [rad] and translation [m] of the world's, then of the platform's, shape (12,).
    """
    world, platform = (turned(RigidTransform(), twist) for twist in (twists[:6], twists[6:]))
    cables = replace(
        model.cables, p_WA=world @ model.cables.p_WA, p_PB=platform @ model.cables.p_PB
    )
    return replace(
        model,
        cables=cables,
        X_PC=platform @ model.X_PC,
        tags={tag: world @ X_WT for tag, X_WT in model.tags.items()},
        X_WK=world @ model.X_WK,
        X_PM=platform @ model.X_PM,
    )


def model_difference(model: CalibrationModel, other: CalibrationModel) -> Array:
    """The step that leads from another model to this one, shape (n,); inverse of `moved_model`."""
    parts = []
    for key in GROUPS:
        one, before = _value(model, key), _value(other, key)
        if key == "tags":
            parts += [pose_step(X, before[tag]) for tag, X in one.items()]
        elif key in POSE_GROUPS:
            parts.append(pose_step(one, before))
        else:
            parts.append(np.ravel(np.transpose(one - before)))
    return np.concatenate(parts)


def turned(X: RigidTransform, step: Array) -> RigidTransform:
    """A pose turned by a rotation vector [rad] and moved [m] in the frame it stands in, (6,)."""
    R = rotation_from_vector(step[:3]) @ X.rotation()
    return RigidTransform(RotationMatrix(R), X.translation() + step[3:])


def pose_step(X: RigidTransform, other: RigidTransform) -> Array:
    """The step that `turned` leads from another pose to this one by, shape (6,) [rad, m]."""
    turn = rotation_vector(X.rotation() @ other.rotation().inverse())
    return np.concatenate([turn, X.translation() - other.translation()])
