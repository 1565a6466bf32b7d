"""Robots of GRAB's tools for underactuated robots with swivelling pulleys, as JSON files.

Both of their schemas: a list `actuator` of pulleys and winches with `active` cables, or a list
`cable`. A cable arrives at D along k, wraps round a pulley whose plane turns about k, and holds the
platform in A; gravity is 9.80665 m/s^2 against `gravity_axis`.

Source: github.com/IRMA-LAB/cdpr_matlab, its files and what reads them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.models.formats.draft import DraftCable, RobotDraft
from cdpr_drake.models.formats.reading import fail, number, numbers, read_json, robot_name

TOOL = "GRAB JSON"

GRAVITY = 9.80665
"""What that tool has [m/s^2]."""

_UNIT = 1e-3
"""By how much the length of an axis may differ from 1."""

_UPRIGHT = 1e-12


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
    content = read_json(path)
    if not is_grab(content):
        raise fail(
            path, "top", type(content).__name__, "an object with platform and actuator or cable"
        )
    draft = RobotDraft(name=robot_name(path.stem), tool=TOOL, title=f"from {path.name}")
    draft.motion, draft.gravity = "3R3T", GRAVITY
    _platform(path, content["platform"], draft)
    _gravity(path, content["platform"], draft)
    key = "actuator" if isinstance(content.get("actuator"), list) else "cable"
    idle = 0
    for index, item in enumerate(content[key]):
        where = f"{key}[{index}]"
        if not isinstance(item, dict):
            raise fail(path, where, item, "an object")
        if item.get("active", True) in (False, 0):
            idle += 1
            continue
        draft.cables.append(_cable(path, where, item, f"C{index + 1}"))
    if idle:
        draft.remarks.append(f"{idle} cables that are not active were left out.")
    if not draft.cables:
        raise fail(path, key, "no active cable", "at least one")
    if len(draft.cables) < 6:
        draft.remarks.append(
            f"{len(draft.cables)} cables for six degrees of freedom: an underactuated robot."
        )
    if "actuation_mask" in content["platform"] or "controlled_vars_mask" in content:
        draft.remarks.append("Which coordinates are controlled is the controller's; not kept.")
    return draft


def _platform(path: Path, platform: dict[str, Any], draft: RobotDraft) -> None:
    draft.mass = number(path, "platform.mass", platform.get("mass"))
    given = platform.get("pos_PG_loc", platform.get("pos_G_loc", [0.0, 0.0, 0.0]))
    draft.center_of_mass = numbers(path, "platform.pos_PG_loc", given, 3)
    matrix = platform.get("inertia_mat_G_loc")
    if matrix is None:
        return
    if not isinstance(matrix, list) or len(matrix) != 3:
        raise fail(path, "platform.inertia_mat_G_loc", matrix, "three rows of three numbers")
    about_G = np.array(
        [numbers(path, f"platform.inertia_mat_G_loc[{k}]", row, 3) for k, row in enumerate(matrix)]
    )
    if not np.allclose(about_G, about_G.T, rtol=1e-6, atol=1e-9):
        raise fail(path, "platform.inertia_mat_G_loc", about_G.tolist(), "a symmetric matrix")
    draft.inertia = about_G[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)]
    for name in ("ext_force_loc", "ext_torque_loc", "ext_moments_loc"):
        if name in platform and np.any(numbers(path, f"platform.{name}", platform[name], 3)):
            draft.remarks.append(f"platform.{name} is a load and was not kept.")


def _gravity(path: Path, platform: dict[str, Any], draft: RobotDraft) -> None:
    """Direction of gravity in the file's base frame, against `gravity_axis`."""
    given = platform.get("gravity_axis", platform.get("grav_ax"))
    if given is None:
        return
    axis = numbers(path, "platform.gravity_axis", given, 3)
    size = float(np.linalg.norm(axis))
    if size == 0.0:
        raise fail(path, "platform.gravity_axis", axis.tolist(), "a direction, not zero")
    axis /= size
    sine = float(np.linalg.norm(np.cross(axis, [0.0, 0.0, 1.0])))
    if sine < _UPRIGHT and axis[2] > 0.0:
        return
    draft.gravity_direction = -axis + 0.0
    draft.remarks.append(
        f"Gravity is tilted by {np.degrees(np.arctan2(sine, axis[2])):.4g} deg against -z of the "
        "file's base frame, which W is."
    )


def _cable(path: Path, where: str, item: dict[str, Any], name: str) -> DraftCable:
    pulley = item.get("pulley", item)
    winch = item.get("winch", item)
    if not isinstance(pulley, dict) or not isinstance(winch, dict):
        raise fail(path, where, item, "objects pulley and winch")
    D = pulley.get("pos_OD_glob", pulley.get("pos_D_glob"))
    A = winch.get("pos_PA_loc", winch.get("pos_A_loc"))
    radius = number(
        path, f"{where}.pulley.radius", pulley.get("radius", pulley.get("swivel_pulley_r", 0.0))
    )
    if radius < 0.0:
        raise fail(path, f"{where}.pulley.radius", radius, "at least 0 [m]")
    axis = None
    if "vers_k" in pulley:
        axis = numbers(path, f"{where}.pulley.vers_k", pulley["vers_k"], 3)
        size = float(np.linalg.norm(axis))
        if abs(size - 1.0) > _UNIT:
            raise fail(path, f"{where}.pulley.vers_k", axis.tolist(), "a vector of length 1")
        axis = axis / size
    return DraftCable(
        name=name,
        exit_point=numbers(path, f"{where}.pos_OD_glob", D, 3),
        anchor_point=numbers(path, f"{where}.pos_PA_loc", A, 3),
        pulley_radius=radius,
        swivel_axis=axis,
    )
