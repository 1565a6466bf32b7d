"""The Maslow 4's maslow.yaml: a router on four belts, on the floor or upright.

`kinematics: MaslowKinematics:` has the anchors [mm] tlX, tlY, tlZ, trX, ... of top left, top right,
bottom left and bottom right; older firmware has Maslow_tlX, ... at the top. A belt leaves the sled
z above its anchor. All belts point to the middle of the sled, a = beltEndExtension + armLength past
their end, so that it moves as a point in a plane. `Maslow_vertical` says that the plane is upright:
x and y of the file are x and z of W then, and out of the board is -y.

At a distance d across z the firmware has belts of hypot(d - a, z) since October 2024: arms stay
level and only the belt is inclined. They are arms that swivel about the exit points here, which is
the same, since the sled does not turn. Before that, in files with the settings at the top, belts
had hypot(d, z) - a, a straight line to the middle.

Source: github.com/MaslowCNC/Maslow_4, firmware/FluidNC/data/maslow.yaml, its web page's words on
the settings, and pull request 157, MaslowKinematics::compute.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from cdpr_drake.arrays import Array
from cdpr_drake.formats.draft import DraftCable, RobotDraft, deviation_lines
from cdpr_drake.models.file_kinds import (
    MASLOW_CORNERS,
    MASLOW_SECTION,
    maslow_settings,
)
from cdpr_drake.models.foreign_text import (
    YAML_WORDS,
    fail,
    kind_of,
    number,
    read_yaml,
    robot_name,
)

TOOL = "Maslow YAML"

MM = 1e-3

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
    _arms(path, settings, content, R, draft)
    for name in ("Scale_X", "Scale_Y"):
        scale = content.get(f"Maslow_{name}", 1.0)
        if number(path, f"Maslow_{name}", scale) != 1.0:
            draft.remarks.append(f"Maslow_{name}, {scale}, was not kept.")
    _others(content, draft)
    return draft


def _arms(
    path: Path, settings: dict[str, Any], content: dict[str, Any], R: Array, draft: RobotDraft
) -> None:
    """What is between belts and the middle of the sled."""
    arm = sum(number(path, name, settings[name]) for name in _EXTRA if name in settings)
    if arm == 0.0:
        return
    if "kinematics" not in content:
        draft.remarks.append(
            f"Belts end {arm:g} mm before the middle of the sled, to which lengths go here."
        )
        return
    if arm < 0.0:
        raise fail(path, " + ".join(_EXTRA), f"{arm:g}", "at least 0 [mm]")
    draft.arm = MM * arm
    for cable in draft.cables:
        cable.swivel_axis = R[:, 2] if R[2, 2] == 1.0 else -R[:, 2]


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

    It holds exit points, from the corner of the board, and arms, whose ends belts have none of.
    """
    upright = draft.axis is not None and abs(float(draft.axis[1])) == 1.0
    R, axes = (_R_UPRIGHT, [0, 2, 1]) if upright else (np.eye(3), [0, 1, 2])
    anchors: dict[str, float] = {}
    stds: dict[str, float] = {}
    for corner, cable in zip(MASLOW_CORNERS, draft.cables, strict=True):
        point = R.T @ (cable.exit_point - cable.anchor_point) / MM
        if not upright:
            point[2] -= (draft.plane_height or 0.0) / MM
        point[2] *= -1.0
        anchors |= {f"{corner}{k}": float(x) + 0.0 for k, x in zip("XYZ", point, strict=True)}
        stds |= zip((f"{corner}{k}" for k in "XYZ"), cable.point_std[axes], strict=True)
    if draft.arm is not None:
        anchors |= {"beltEndExtension": 0.0, "armLength": draft.arm / MM}
    content = {"Maslow_vertical": upright, "kinematics": {MASLOW_SECTION: anchors}}
    lines: list[str] = []
    for line in yaml.safe_dump(content, sort_keys=False).splitlines():
        key = line.strip().partition(":")[0]
        lines += [*deviation_lines("    #", key, stds.get(key, np.nan)), line]
    return "\n".join(lines) + "\n"
