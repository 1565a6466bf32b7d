"""Robots of GRAB's tools for robots with swivelling pulleys, as JSON files.

Both of their schemas: a list `actuator` of pulleys and winches with `active` cables, or a list
`cable`. A cable arrives at D along k and wraps round a pulley whose plane turns about k. Where the
pulley is on the frame (`pos_OD_glob`, `vers_k` in W), the cable then holds the platform in A
(`pos_PA_loc`); where winch and pulley ride on the platform (`pos_PD_loc`, `vers_k_loc` in P), it
ends in a point A of the frame (`pos_OA_glob`). Gravity is 9.80665 m/s^2 against `gravity_axis`.

Source: github.com/IRMA-LAB/cdpr_matlab and, for pulleys on the platform,
github.com/fzoffoli/OCDPR_SelfCalibration: their files and what reads them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.formats.draft import DraftCable, RobotDraft
from cdpr_drake.models.foreign_text import (
    JSON_WORDS,
    fail,
    kind_of,
    number,
    numbers,
    read_json,
    robot_name,
)

TOOL = "GRAB JSON"

GRAVITY = 9.80665
"""What that tool has [m/s^2]."""

_UNIT = 1e-3
"""By how much the length of an axis may differ from 1."""

_UPRIGHT = 1e-12

_EXITS, _ANCHORS = (
    ("pos_OD_glob", "pos_D_glob", "pos_glob_D"),
    ("pos_PA_loc", "pos_A_loc", "pos_loc_A"),
)
"""Names of the points of a cable over a pulley on the frame, in the order of schemas."""

_ON_BOARD = ("pos_OA_glob", "pos_PD_loc")
"""Names of the points of a cable over a pulley on the platform."""

_MASS_CENTERS = ("pos_PG_loc", "pos_G_loc", "pos_loc_G")
_INERTIAS = ("inertia_mat_G_loc", "inertia_mat_loc_G")
_GRAVITY_AXES = ("gravity_axis", "grav_ax")
_LOADS = ("ext_force_loc", "ext_torque_loc", "ext_moments_loc")
_RADII = ("radius", "swivel_pulley_r")

_PATTERNS = {"THREE_R_THREE_T": "3R3T", "THREE_T": "3T", "ONE_R_TWO_T": "2T1R", "TWO_T": "2T"}
"""Motion types by the names of `motion_pattern`."""

_FLAT = 1e-6
"""Points within this of a plane across an axis of W lie in it [m]."""


def is_grab(content: Any) -> bool:
    """Whether a JSON document is a robot of these tools."""
    return (
        isinstance(content, dict)
        and isinstance(content.get("platform"), dict)
        and any(isinstance(content.get(key), list) for key in ("actuator", "cable"))
    )


def read_grab(path: Path) -> RobotDraft:
    """Reads a robot of GRAB's tools; cables that are not active are left out.

    Raises:
        RobotFileError: The file does not describe one; says where.
    """
    content, odd = read_json(path)
    if not is_grab(content):
        raise fail(
            path, "top", kind_of(content, JSON_WORDS),
            "an object with the object platform and the list actuator or cable",
        )  # fmt: skip
    draft = RobotDraft(name=robot_name(path.stem), tool=TOOL, title=f"from {path.name}")
    draft.gravity = GRAVITY
    draft.remarks.extend(odd)
    platform, kept = content["platform"], _Kept()
    _platform(path, platform, draft, kept)
    _gravity(path, platform, draft, kept)
    key = "actuator" if isinstance(content.get("actuator"), list) else "cable"
    idle, drums = 0, set()
    for index, item in enumerate(content[key]):
        where = f"{key}[{index}]"
        if not isinstance(item, dict):
            raise fail(path, where, item, "an object")
        if item.get("active", True) in (False, 0):
            idle += 1
            continue
        parts = _parts(path, where, item)
        draft.cables.append(_cable(path, where, parts, f"C{index + 1}", draft, kept))
        drums.add(_drum(path, where, parts, kept))
        kept.unread.update(name for part in parts for name in part)
    if idle:
        draft.remarks.append(f"{idle} cables that are not active were left out.")
    if not draft.cables:
        raise fail(path, key, "no active cable", "at least one")
    _motion(content.get("motion_pattern", "THREE_R_THREE_T"), draft)
    m, n = len(draft.cables), draft.motion_type().freedom
    if m < n:
        draft.remarks.append(f"{m} cables for {n} degrees of freedom: an underactuated robot.")
    _drums(drums, draft)
    kept.unread.update(platform, content)
    rest = sorted(kept.unread - kept.read - {key, "platform", "motion_pattern"})
    if rest:
        draft.remarks.append(f"Keys that were not kept: {', '.join(rest)}.")
    return draft


class _Kept:
    """Keys of a file that were read, and those that it has."""

    def __init__(self) -> None:
        self.read = {"active", "pulley", "winch"}
        self.unread: set[str] = set()

    def first(self, parts: tuple[dict[str, Any], ...], names: tuple[str, ...]) -> tuple[str, Any]:
        """The first of some names that some objects have, with its value; the first, None."""
        self.read.update(names)
        for name in names:
            for part in parts:
                if name in part:
                    return name, part[name]
        return names[0], None


def _platform(path: Path, platform: dict[str, Any], draft: RobotDraft, kept: _Kept) -> None:
    draft.mass = number(path, "platform.mass", kept.first((platform,), ("mass",))[1])
    name, given = kept.first((platform,), _MASS_CENTERS)
    if given is not None:
        draft.center_of_mass = numbers(path, f"platform.{name}", given, 3)
    else:
        draft.center_of_mass = np.zeros(3)
        draft.remarks.append(f"No platform.{name}: the centre of mass was taken to be in Po.")
    for name in _LOADS:
        given = kept.first((platform,), (name,))[1]
        if given is not None and np.any(numbers(path, f"platform.{name}", given, 3)):
            draft.remarks.append(f"platform.{name} is a load and was not kept.")
    name, matrix = kept.first((platform,), _INERTIAS)
    if matrix is None:
        return
    key = f"platform.{name}"
    if not isinstance(matrix, list) or len(matrix) != 3:
        raise fail(path, key, matrix, "three rows of three numbers")
    about_G = np.array([numbers(path, f"{key}[{k}]", row, 3) for k, row in enumerate(matrix)])
    if not np.allclose(about_G, about_G.T, rtol=1e-6, atol=1e-9):
        raise fail(path, key, about_G.tolist(), "a symmetric matrix")
    draft.inertia = about_G[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)]


def _gravity(path: Path, platform: dict[str, Any], draft: RobotDraft, kept: _Kept) -> None:
    """Direction of gravity in the file's base frame, against `gravity_axis`."""
    name, given = kept.first((platform,), _GRAVITY_AXES)
    if given is None:
        return
    axis = numbers(path, f"platform.{name}", given, 3)
    size = float(np.linalg.norm(axis))
    if size == 0.0:
        raise fail(path, f"platform.{name}", axis.tolist(), "a direction, not zero")
    axis /= size
    sine = float(np.linalg.norm(np.cross(axis, [0.0, 0.0, 1.0])))
    if sine < _UPRIGHT and axis[2] > 0.0:
        return
    draft.gravity_direction = -axis + 0.0
    draft.remarks.append(
        f"Gravity is tilted by {np.degrees(np.arctan2(sine, axis[2])):.4g} deg against -z of the "
        "file's base frame, which W is."
    )


def _motion(pattern: object, draft: RobotDraft) -> None:
    """The motion type; a plane is the one across an axis of W in which all points lie."""
    motion = _PATTERNS.get(str(pattern), "")
    if motion in ("2T1R", "2T"):
        exits, anchors = draft.exit_points(), draft.anchor_points()
        flat = np.maximum(np.ptp(exits, axis=1), np.ptp(anchors, axis=1)) < _FLAT
        if np.count_nonzero(flat) == 1:
            k = int(np.argmax(flat))
            draft.origin = np.where(flat, exits[:, 0] - anchors[:, 0], 0.0)
            if k == 2:
                draft.plane_height = float(draft.origin[2])
            else:
                draft.axis = np.eye(3)[k]
        else:
            motion = ""
    draft.motion = motion or "3R3T"
    if not motion:
        draft.remarks.append(f"motion_pattern {pattern} was read as a free body, 3R3T.")


def _parts(path: Path, where: str, item: dict[str, Any]) -> tuple[dict[str, Any], ...]:
    """The objects that say something of one cable."""
    parts = (item.get("pulley", {}), item.get("winch", {}), item)
    for name, part in zip(("pulley", "winch"), parts, strict=False):
        if not isinstance(part, dict):
            raise fail(path, f"{where}.{name}", part, "an object")
    return parts


def _cable(
    path: Path, where: str, parts: tuple[dict[str, Any], ...], name: str, draft: RobotDraft,
    kept: _Kept,
) -> DraftCable:  # fmt: skip
    exit_, p_WA = kept.first(parts, (*_EXITS, _ON_BOARD[0]))
    anchor, p_PB = kept.first(parts, (*_ANCHORS, _ON_BOARD[1]))
    found = [key for key in (*_EXITS, *_ANCHORS, *_ON_BOARD) if any(key in part for part in parts)]
    on_board = (exit_ == _ON_BOARD[0]) and (anchor == _ON_BOARD[1])
    if len(found) != 2 or p_WA is None or p_PB is None or (
        not on_board and (exit_ in _ON_BOARD or anchor in _ON_BOARD)
    ):  # fmt: skip
        raise fail(
            path, where, " and ".join(found),
            f"{_EXITS[0]} and {_ANCHORS[0]} of a pulley on the frame, or {' and '.join(_ON_BOARD)} "
            "of one on the platform",
        )  # fmt: skip
    key, given = kept.first(parts, _RADII)
    radius = number(path, f"{where}.{key}", 0.0 if given is None else given)
    if radius < 0.0:
        raise fail(path, f"{where}.{key}", radius, "at least 0 [m]")
    axis = _axis(path, where, parts, "vers_k_loc" if on_board else "vers_k", kept)
    if axis is None and radius > 0.0:
        draft.remarks.append(f"{name}: its pulley has no axis k; that was taken to be z.")
    cable = DraftCable(
        name=name,
        exit_point=numbers(path, f"{where}.{exit_}", p_WA, 3),
        anchor_point=numbers(path, f"{where}.{anchor}", p_PB, 3),
        pulley_radius=0.0,
    )
    if on_board:
        cable.anchor_pulley_radius, cable.anchor_swivel_axis = radius, axis
    else:
        cable.pulley_radius, cable.swivel_axis = radius, axis
    return cable


def _axis(
    path: Path, where: str, parts: tuple[dict[str, Any], ...], name: str, kept: _Kept
) -> Array | None:
    """The unit vector k of a pulley, shape (3,)."""
    given = kept.first(parts, (name,))[1]
    if given is None:
        return None
    axis = numbers(path, f"{where}.pulley.{name}", given, 3)
    size = float(np.linalg.norm(axis))
    if abs(size - 1.0) > _UNIT:
        raise fail(path, f"{where}.pulley.{name}", axis.tolist(), "a vector of length 1")
    return np.asarray(axis / size, float)


def _drum(path: Path, where: str, parts: tuple[dict[str, Any], ...], kept: _Kept) -> float | None:
    """Radius of a winch's drum [m]."""
    given = kept.first(parts, ("drum_diameter",))[1]
    if given is None:
        return None
    diameter = number(path, f"{where}.winch.drum_diameter", given)
    if diameter <= 0.0:
        raise fail(path, f"{where}.winch.drum_diameter", diameter, "above 0 [m]")
    return diameter / 2.0


def _drums(radii: set[float | None], draft: RobotDraft) -> None:
    """The drum that all winches share."""
    if len(radii) == 1:
        draft.drum_radius = radii.pop()
    else:
        draft.remarks.append("Drums differ from winch to winch, for which there is no place here.")
