"""The Maslow 4's maslow.yaml: a router on four belts, on the floor or upright.

`kinematics: MaslowKinematics:` has the anchors [mm] tlX, tlY, tlZ, trX, ... of top left, top right,
bottom left and bottom right; older firmware has Maslow_tlX, ... at the top. A belt leaves the sled
z above its anchor. All belts point to the middle of the sled, a = beltEndExtension + armLength past
their end, so that it moves as a point in a plane. `Maslow_vertical` says that the plane is upright:
x and y of the file are x and z of W then, and out of the board is -y.

At a distance d across z the firmware has belts of hypot(d - a, z) since October 2024: arms stay
level and only the belt is inclined. Before that it had hypot(d, z) - a, a straight line to the
middle, which is the geometry here.

Source: github.com/MaslowCNC/Maslow_4, firmware/FluidNC/data/maslow.yaml, its web page's words on
the settings, and pull request 157, MaslowKinematics::compute.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from cdpr_drake.arrays import Array
from cdpr_drake.models.formats.draft import DraftCable, RobotDraft
from cdpr_drake.models.formats.file_kinds import (
    MASLOW_CORNERS,
    MASLOW_SECTION,
    maslow_settings,
)
from cdpr_drake.models.formats.reading import (
    YAML_WORDS,
    fail,
    kind_of,
    number,
    read_yaml,
    robot_name,
)

TOOL = "Maslow YAML"

MM = 1e-3

NEAR = 0.5
"""Length of belt for which a remark says what level arms change [m]."""

_EXTRA = ("beltEndExtension", "armLength")

_R_UPRIGHT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""From the file's axes to those of W, where the board is upright."""


def read_maslow(path: Path) -> RobotDraft:
    """Reads a point in a plane on four belts.

    Raises:
        RobotFileError: The file does not describe one; says where.
    """
    content = read_yaml(path)
    settings = maslow_settings(content) if isinstance(content, dict) else None
    if settings is None:
        found = kind_of(content, YAML_WORDS)
        accepted = f"kinematics with {MASLOW_SECTION}, or Maslow_tlX and the like"
        raise fail(path, "top", found, accepted)
    upright = content.get("Maslow_vertical", False)
    if not isinstance(upright, bool):
        raise fail(path, "Maslow_vertical", upright, "true or false")
    draft = RobotDraft(name=robot_name(path.stem), tool=TOOL, title=f"from {path.name}")
    draft.motion = "2T"
    draft.axis = np.array([0.0, 1.0, 0.0]) if upright else None
    R = _R_UPRIGHT if upright else np.eye(3)
    points = np.array([_anchor(path, settings, corner) for corner in MASLOW_CORNERS])
    for corner, point in zip(MASLOW_CORNERS, points, strict=True):
        draft.cables.append(DraftCable(name=corner, exit_point=R @ point, anchor_point=np.zeros(3)))
    middle = np.array([*points[:, :2].mean(axis=0), 0.0])
    draft.home_position = R @ middle
    if not upright:
        draft.plane_height = 0.0
    draft.remarks.append("home is the middle of the anchors.")
    extra = [number(path, name, settings[name]) for name in _EXTRA if name in settings]
    if any(extra):
        near, middle_off = _level_arms(points, MM * sum(extra), middle)
        draft.remarks.append(
            f"Belts end {sum(extra):g} mm before the middle of the sled, to which lengths go here, "
            "in a straight line. Firmware since October 2024 keeps arms level: its belts are "
            f"longer than that, by up to {1e3 * near:.2g} mm where {NEAR:g} m of belt are out, and "
            f"{1e3 * middle_off:.2g} mm in the middle of the anchors."
        )
    for name in ("Scale_X", "Scale_Y"):
        scale = content.get(f"Maslow_{name}", 1.0)
        if number(path, f"Maslow_{name}", scale) != 1.0:
            draft.remarks.append(f"Maslow_{name}, {scale}, was not kept.")
    _others(content, draft)
    return draft


def _level_arms(points: Array, arm: float, middle: Array) -> tuple[float, float]:
    """By how much belts of level arms are longer than straight ones, at most [m].

    Where `NEAR` of each belt is out, and in the middle of the anchors.
    """
    z = points[:, 2]
    far = np.linalg.norm((points - middle)[:, :2], axis=1)
    near = np.full(len(points), arm + NEAR)
    off = [np.hypot(d - arm, z) - (np.hypot(d, z) - arm) for d in (near, far)]
    return float(np.max(off[0])), float(np.max(off[1]))


def _others(content: dict[str, Any], draft: RobotDraft) -> None:
    """Remarks on what a robot has no place for: the machine's electronics, axes, retraction."""
    read = {f"{corner}{axis}" for corner in MASLOW_CORNERS for axis in "XYZ"} | set(_EXTRA)
    kinematics = content.get("kinematics")
    left = []
    for key in content:
        if key == "kinematics" and isinstance(kinematics, dict):
            own = kinematics.get(MASLOW_SECTION)
            left += [f"{key}.{other}" for other in kinematics if other != MASLOW_SECTION]
            left += [f"{key}.{MASLOW_SECTION}.{k}" for k in own or {} if str(k) not in read]
        elif str(key).removeprefix("Maslow_") not in read | {"vertical", "Scale_X", "Scale_Y"}:
            left.append(str(key))
    if left:
        draft.remarks.append(f"Not kept: {', '.join(left)}.")


def _anchor(path: Path, settings: dict[str, Any], corner: str) -> Array:
    """x and y of an anchor, and minus how far its belt leaves the sled above it [m]."""
    default = 0.0 if corner == "bl" else None  # older firmware has it at the origin
    x, y, z = (
        number(path, f"{corner}{axis}", settings.get(f"{corner}{axis}", none))
        for axis, none in (("X", default), ("Y", default), ("Z", 0.0))
    )
    return MM * np.array([x, y, -z])


def write_maslow(draft: RobotDraft) -> str:
    """Anchors and whether the plane is upright; all else is the machine's own.

    It holds exit points, from the corner of the board.
    """
    upright = draft.axis is not None and abs(float(draft.axis[1])) == 1.0
    R = _R_UPRIGHT if upright else np.eye(3)
    anchors: dict[str, float] = {}
    for corner, cable in zip(MASLOW_CORNERS, draft.cables, strict=True):
        point = R.T @ (cable.exit_point - cable.anchor_point) / MM
        if not upright:
            point[2] -= (draft.plane_height or 0.0) / MM
        point[2] *= -1.0
        anchors |= {f"{corner}{k}": float(x) + 0.0 for k, x in zip("XYZ", point, strict=True)}
    content = {"Maslow_vertical": upright, "kinematics": {MASLOW_SECTION: anchors}}
    return yaml.safe_dump(content, sort_keys=False)
