"""Robot files of the cable robot simulator for Gazebo, in both schemas that its forks use.

One has the sections `frame`, `platform`, `points` at its top and gives the platform by its edges;
the other has them below `model` and gives the platform by two corners. Points are in the world
frame and in that of the platform, whose origin is the middle of its box unless the corners say
otherwise. `rpy` are radians, R = Rz Ry Rx.

Source: github.com/oKermorgant/cdpr (cdpr/sdf, cdpr3/sdf); Gazebo thesis 5.2, 5.3.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml
from pydrake.math import RollPitchYaw

from cdpr_drake.arrays import Array
from cdpr_drake.formats.draft import DraftCable, RobotDraft
from cdpr_drake.formats.unread import mark_below, not_kept, watched
from cdpr_drake.models.file_kinds import is_gazebo_yaml
from cdpr_drake.models.foreign_text import (
    YAML_WORDS,
    fail,
    kind_of,
    number,
    numbers,
    read_yaml,
    robot_name,
)

TOOL = "Gazebo cable robot YAML"

_PRESENTATION = {
    f"{model}{key}"
    for model in ("", "model.")
    for key in ("frame.color", "frame.type", "platform.color", "platform.type", "platform.visual")
}
"""Keys that only say how things look, and that they are boxes."""

_OUTSIDE = 1.5
"""Anchor points farther from the middle than this many half edges are not on the platform."""


def read_gazebo_yaml(path: Path) -> RobotDraft:
    """Reads a robot of the Gazebo simulator.

    Raises:
        RobotFileError: The file does not describe one; says where.
    """
    document = read_yaml(path)
    if not is_gazebo_yaml(document):
        found = kind_of(document, YAML_WORDS)
        raise fail(path, "top", found, "a mapping with points and platform")
    content = watched(document)
    body = content.get("model", content)
    platform = _section(path, body, "platform")
    draft = RobotDraft(name=robot_name(path.stem), tool=TOOL, title=f"from {path.name}")
    draft.motion = "3R3T"
    draft.mass = number(path, "platform.mass", platform.get("mass"))
    _box(path, platform, draft)
    _inertia(path, platform, draft)
    _home(path, platform, body, draft)
    _frame(path, body, draft)
    cable = _section(path, body, "cable", required=False)
    if "radius" in cable:
        draft.diameter = 2.0 * number(path, "cable.radius", cable["radius"])
    actuated = _section(path, _section(path, body, "joints", required=False), "actuated", False)
    upper = actuated.get("effort")
    lower = actuated.get("min")
    if "velocity" in actuated:
        draft.cable_speed = number(path, "joints.actuated.velocity", actuated["velocity"])
    points = body["points"]
    if not isinstance(points, list) or not points:
        raise fail(path, "points", points, "a list of {frame, platform}")
    for index, point in enumerate(points):
        where = f"points[{index}]"
        if not isinstance(point, dict):
            raise fail(path, where, point, "a mapping with frame and platform")
        draft.cables.append(
            DraftCable(
                name=f"C{index + 1}",
                exit_point=numbers(path, f"{where}.frame", point.get("frame"), 3),
                anchor_point=numbers(path, f"{where}.platform", point.get("platform"), 3),
                lower=None if lower is None else number(path, "joints.actuated.min", lower),
                upper=None if upper is None else number(path, "joints.actuated.effort", upper),
            )
        )
    _anchors_in_platform(draft)
    _remarks(content, body, draft)
    draft.remarks += not_kept(content, _PRESENTATION)
    return draft


def _section(path: Path, body: dict[str, Any], name: str, required: bool = True) -> dict[str, Any]:
    found = body.get(name)
    if found is None and not required:
        return {}
    if not isinstance(found, dict):
        raise fail(path, name, found, "a mapping")
    return found


def _box(path: Path, platform: dict[str, Any], draft: RobotDraft) -> None:
    if "size" in platform:
        draft.box_size = numbers(path, "platform.size", platform["size"], 3)
        draft.box_center = np.zeros(3)
    elif "lower" in platform and "upper" in platform:
        lower = numbers(path, "platform.lower", platform["lower"], 3)
        upper = numbers(path, "platform.upper", platform["upper"], 3)
        draft.box_size, draft.box_center = upper - lower, (lower + upper) / 2.0
    if draft.box_size is not None and np.any(draft.box_size <= 0.0):
        raise fail(path, "platform.size", draft.box_size.tolist(), "edges above 0 [m]")
    draft.center_of_mass = np.zeros(3)  # links of the simulator have their mass at the origin


def _inertia(path: Path, platform: dict[str, Any], draft: RobotDraft) -> None:
    if "inertia" in platform:  # its order: xx, yy, zz, xy, xz, yz
        draft.inertia = numbers(path, "platform.inertia", platform["inertia"], 6)
    elif isinstance(platform.get("inertial"), dict):
        given = platform["inertial"]
        draft.inertia = np.array(
            [
                number(path, f"platform.inertial.{key}", given.get(key, 0.0))
                for key in ("xx", "yy", "zz", "xy", "xz", "yz")
            ]
        )


def _home(path: Path, platform: dict[str, Any], body: dict[str, Any], draft: RobotDraft) -> None:
    position = platform.get("position")
    if isinstance(position, dict):
        draft.home_position = numbers(path, "platform.position.xyz", position.get("xyz"), 3)
        rpy = numbers(path, "platform.position.rpy", position.get("rpy", [0, 0, 0]), 3)
        if np.any(np.abs(rpy) > 2.0 * np.pi):
            draft.remarks.append(
                "platform.position.rpy is beyond 2 pi and was taken for degrees, not radians."
            )
            rpy = np.radians(rpy)
        draft.R_WP = RollPitchYaw(rpy).ToRotationMatrix().matrix()
    elif isinstance(body.get("global_frame"), dict):
        draft.home_position = numbers(
            path, "global_frame.position", body["global_frame"].get("position"), 3
        )
        draft.R_WP = np.eye(3)


def _frame(path: Path, body: dict[str, Any], draft: RobotDraft) -> None:
    frame = _section(path, body, "frame", required=False)
    if "lower" in frame and "upper" in frame:
        draft.frame_lower = numbers(path, "frame.lower", frame["lower"], 3)
        draft.frame_upper = numbers(path, "frame.upper", frame["upper"], 3)
    if "radius" in frame:
        draft.beam = 2.0 * number(path, "frame.radius", frame["radius"])


def _anchors_in_platform(draft: RobotDraft) -> None:
    """Turns anchor points that the file gives in the world frame into those of the platform."""
    if draft.box_size is None or draft.home_position is None or draft.R_WP is None:
        return
    assert draft.box_center is not None
    points = draft.anchor_points()
    moved = draft.R_WP.T @ (points - draft.home_position[:, np.newaxis])
    if _off_the_box(draft, points) and not _off_the_box(draft, moved):
        for cable, point in zip(draft.cables, moved.T, strict=True):
            cable.anchor_point = point
        draft.remarks.append(
            "The platform's points lie off the platform as given, and on it where they are taken "
            "for points in the world frame at the initial pose; so they were."
        )


def _off_the_box(draft: RobotDraft, points: Array) -> bool:
    assert draft.box_size is not None
    assert draft.box_center is not None
    beyond = (
        np.abs(points - draft.box_center[:, np.newaxis]) / (draft.box_size / 2.0)[:, np.newaxis]
    )
    return bool(np.any(beyond > _OUTSIDE))


def _remarks(content: dict[str, Any], body: dict[str, Any], draft: RobotDraft) -> None:
    cable = body.get("cable", {})
    if isinstance(cable, dict) and cable.get("mass") is not None:
        draft.remarks.append(
            f"cable.mass, {cable['mass']}, is that of a link of the simulator and was not kept."
        )
    if body.get("sim_cables") is not None:
        draft.remarks.append("sim_cables chooses how that simulator draws cables; not kept.")
    if content.get("controllers") is not None:
        mark_below(content["controllers"])
        draft.remarks.append("Controllers were not kept; scenarios have their own.")


def write_gazebo_yaml(draft: RobotDraft) -> str:
    """The robot in the first schema, whose platform frame lies in the middle of the box.

    It holds the points, box, mass, inertia, initial pose, frame, cable radius, tension limits and
    cable speed; neither materials, pulleys, motors nor a centre of mass off the middle.
    """
    assert draft.box_size is not None
    assert draft.box_center is not None
    assert draft.R_WP is not None
    assert draft.home_position is not None
    middle = draft.home_position + draft.R_WP @ draft.box_center
    rpy = RollPitchYaw(_rotation(draft.R_WP)).vector()
    limits = [(cable.lower or 0.0, cable.upper or 0.0) for cable in draft.cables]
    content = {
        "cable": {"mass": 0.001, "radius": draft.diameter and draft.diameter / 2.0},
        "frame": {
            "color": "Grey", "lower": _list(draft.frame_lower), "upper": _list(draft.frame_upper),
            "radius": (draft.beam or 0.04) / 2.0, "type": "box",
        },
        "joints": {
            "actuated": {
                "damping": 1, "effort": min(high for _, high in limits),
                "min": max(low for low, _ in limits), "velocity": draft.cable_speed,
            },
            "passive": {"damping": 0.01, "effort": 1000, "velocity": 10},
        },
        "platform": {
            "color": "Blue", "inertia": _list(draft.inertia), "mass": draft.mass,
            "position": {"rpy": _list(rpy), "xyz": _list(middle)},
            "size": _list(draft.box_size), "type": "box", "visual": "box",
        },
        "points": [
            {
                "frame": _list(cable.exit_point),
                "platform": _list(cable.anchor_point - draft.box_center),
            }
            for cable in draft.cables
        ],
        "sim_cables": True,
    }  # fmt: skip
    return yaml.safe_dump(content, default_flow_style=None, sort_keys=True)


def _rotation(matrix: Array) -> Any:
    from pydrake.math import RotationMatrix

    return RotationMatrix(matrix)


def _list(values: Array | None) -> list[float] | None:
    return None if values is None else [float(value) for value in values]
