"""What a robot file needs and a foreign file lacks: assumed here, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import yaml
from pydrake.math import RollPitchYaw, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.formats.draft import RobotDraft
from cdpr_drake.formats.home_search import farthest_pose
from cdpr_drake.schema.declarations import LARGEST

GRAVITY = 9.81
MASS = 1.0
"""Of a platform, for files of firmwares, which know lengths alone [kg]."""

STEEL_ROPE_MODULUS = 100e9
STEEL_DENSITY = 7850.0
WORKING_STRESS = 200e6
"""Stress at the largest tension from which a diameter follows [Pa]; wires bear ten times that."""

RETARDATION = 3e-4
WEIGHTS = 5.0
"""Largest tension, where a file gives none, in weights of the platform."""

DRUM_RADIUS = 0.05
CABLE_SPEED = 1.0
THIN = 0.2
"""Smallest edge of an assumed platform box, as a share of its longest."""

FLAT = 0.25
"""Exit points within this share of their horizontal extent lie in a plane that robots hang from."""

_TRIANGLE = 1e-9

SAME_POINT = 1e-9
"""Anchor points nearer to each other [m] are one."""


@dataclass(frozen=True)
class CompletedDraft:
    """A draft with all that a robot file needs.

    Attributes:
        content: The robot file as a mapping.
        given: Keys that came from the foreign file.
        assumed: Keys that it lacked, with what was assumed and why.
        remarks: What was read otherwise, or not kept.
    """

    content: dict[str, Any]
    given: tuple[str, ...]
    assumed: dict[str, str]
    remarks: tuple[str, ...]

    def yaml(self) -> str:
        """The robot file."""
        return yaml.safe_dump(
            self.content, default_flow_style=None, sort_keys=False, allow_unicode=True, width=100
        )


def complete_draft(draft: RobotDraft) -> CompletedDraft:
    """Fills in what a draft lacks; what it has stays as it is."""
    assumed: dict[str, str] = {}
    given = _given(draft)
    if draft.mass is None:
        draft.mass = _assume(assumed, "platform.mass", MASS, "where a file gives none")
    remarks = [*draft.remarks, *draft.tell_cables_apart()]
    gravity = draft.gravity
    if gravity is None:
        gravity = _assume(assumed, "gravity", GRAVITY, "standard")
    content: dict[str, Any] = {
        "name": draft.name,
        "title": draft.title or f"from {draft.tool}",
        "motion": draft.motion or _assume(assumed, "motion", "3R3T", "a free body"),
    }
    if content["motion"] == "2R3T":
        _find_beam(draft)
    if draft.axis is not None and not np.array_equal(draft.axis, (0.0, 0.0, 1.0)):
        content["axis"] = _list(draft.axis)
    planar = draft.is_level()
    if planar:
        content["plane_height"] = _float(draft.plane_height or 0.0)
    if gravity != GRAVITY:
        content["gravity"] = _float(gravity)
    if not np.array_equal(draft.down(), (0.0, 0.0, -1.0)):
        content["gravity_direction"] = _list(draft.down())
    if draft.motion_type().is_point:
        _to_a_point(draft, remarks)
    content["platform"] = _platform(draft, assumed, remarks, planar)
    lower, upper = _tensions(draft, gravity, assumed, remarks)
    content["cable"] = _material(draft, upper, assumed)
    content["pulley"] = {"radius": _pulley(draft, assumed)}
    if draft.arm is not None:
        content["pulley"]["arm"] = _float(draft.arm)
    content["winch"] = _winch(draft, assumed)
    content["tension_bounds"] = {"lower": _float(lower), "upper": _float(upper)}
    corners = _frame(draft, assumed, remarks, planar)
    home = _home(draft, corners, (lower, upper), gravity, assumed)
    corners = np.minimum(corners[0], home), np.maximum(corners[1], home)
    content["frame"] = {"lower": _list(corners[0]), "upper": _list(corners[1])}
    if draft.beam is not None:
        smallest = float(np.min(corners[1] - corners[0]))
        content["frame"]["beam"] = _float(min(draft.beam, smallest))
    if "frame" in assumed:
        content["frame"]["assumed"] = True
    content["home"] = {"position": _list(home)}
    if draft.R_WP is not None:
        content["home"]["angles_deg"] = _list(_angles_deg(draft.R_WP))
    content["cables"] = [_cable(cable, draft) for cable in draft.cables]
    words = [f"{key}: {value}" for key, value in assumed.items()] + remarks
    content["assumptions"] = f"From {draft.tool}. " + " ".join(
        word if word.endswith(".") else word + "." for word in words
    )
    return CompletedDraft(content, given, assumed, tuple(remarks))


def _assume(assumed: dict[str, str], key: str, value: Any, why: str) -> Any:
    shown = f"{value:.6g}" if isinstance(value, float) else f"{value}"
    assumed[key] = f"{shown}, {why}"
    return value


def _given(draft: RobotDraft) -> tuple[str, ...]:
    """Keys of a robot file that the draft has."""
    keys = {
        "motion": draft.motion, "axis": draft.axis, "platform.mass": draft.mass,
        "platform.center_of_mass": draft.center_of_mass, "platform.inertia": draft.inertia,
        "platform.size": draft.box_size, "home.position": draft.home_position,
        "home.angles_deg": draft.R_WP, "frame": draft.frame_lower, "frame.beam": draft.beam,
        "cable.diameter": draft.diameter, "cable.youngs_modulus": draft.youngs_modulus,
        "cable.linear_density": draft.linear_density, "cable.breaking_load": draft.breaking_load,
        "winch.drum_radius": draft.drum_radius, "winch.gear_ratio": draft.gear_ratio,
        "winch.layers": draft.layers, "cables[].drum_radius": draft.cables[0].drum_radius,
        "cables[].mechanical_advantage": draft.cables[0].mechanical_advantage,
        "winch.motor_speed_rpm": draft.motor_speed_rpm, "winch.inertia": draft.motor_inertia,
        "tension_bounds.lower": draft.cables[0].lower,
        "tension_bounds.upper": draft.cables[0].upper,
        "pulley.radius": draft.cables[0].pulley_radius, "pulley.arm": draft.arm,
        "gravity": draft.gravity,
        "gravity_direction": draft.gravity_direction,
        "cables[].exit_point": draft.cables, "cables[].anchor_point": draft.cables,
        "cables[].swivel_axis": draft.cables[0].swivel_axis,
        "cables[].anchor_pulley_radius": draft.cables[0].anchor_pulley_radius,
        "cables[].anchor_swivel_axis": draft.cables[0].anchor_swivel_axis,
        "cables[].material": next((c.material for c in draft.cables if c.material), None),
    }  # fmt: skip
    return tuple(key for key, value in keys.items() if value is not None)


def _platform(
    draft: RobotDraft, assumed: dict[str, str], remarks: list[str], planar: bool
) -> dict[str, Any]:
    size, center = draft.box_size, draft.box_center
    if size is None:
        points = draft.anchor_points()
        low, high = points.min(axis=1), points.max(axis=1)
        longest = float(np.max(high - low)) or 0.1
        size, center = np.maximum(high - low, THIN * longest), (low + high) / 2.0
        assumed["platform.size"] = (
            f"({', '.join(f'{edge:.4g}' for edge in size)}), the box round the anchor points, no "
            f"edge under {THIN:g} of the longest"
        )
    assert center is not None
    platform = {"mass": draft.mass, "size": _list(size), "box_center": _list(center)}
    if draft.center_of_mass is None:
        assumed["platform.center_of_mass"] = "the middle of the box"
    else:
        platform["center_of_mass"] = _list(draft.center_of_mass)
    inertia = draft.inertia
    if inertia is None:
        assumed["platform.inertia"] = "that of a solid box"
    elif _possible(inertia):
        platform["inertia"] = _list(inertia)
    elif draft.motion_type().is_point:
        assumed["platform.inertia"] = "that of a solid box, which a point mass does not need"
    elif planar and inertia[2] > 0.0:
        platform["inertia"] = _list([inertia[2] / 2.0, inertia[2] / 2.0, inertia[2], 0.0, 0.0, 0.0])
        assumed["platform.inertia"] = "moments about x and y, half of that about z as of a plate"
    else:
        found = ", ".join(f"{value:g}" for value in inertia)
        remarks.append(f"The inertia ({found}) is that of no body; that of a solid box was taken.")
    return platform


def _possible(inertia: Array) -> bool:
    if not np.all(np.abs(inertia) <= LARGEST):
        return False
    xx, yy, zz, xy, xz, yz = inertia
    moments = np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    return bool(moments[0] > 0.0 and moments[0] + moments[1] >= moments[2] * (1.0 - _TRIANGLE))


def _tensions(
    draft: RobotDraft, gravity: float, assumed: dict[str, str], remarks: list[str]
) -> tuple[float, float]:
    lowers = [cable.lower for cable in draft.cables if cable.lower is not None]
    uppers = [cable.upper for cable in draft.cables if cable.upper is not None]
    if len({*lowers}) > 1 or len({*uppers}) > 1:
        remarks.append(
            f"Limits differ from cable to cable, lower {_range(lowers)}, upper {_range(uppers)} N; "
            "a robot here has one pair, and got the largest lower and the smallest upper one."
        )
    lower = (
        max(lowers) if lowers else _assume(assumed, "tension_bounds.lower", 0.0, "slack allowed")
    )
    if uppers:
        return lower, min(uppers)
    weight = (draft.mass or 1.0) * (gravity or GRAVITY)
    words = f"{WEIGHTS:g} weights of the platform"
    return lower, _assume(
        assumed, "tension_bounds.upper", max(WEIGHTS * weight, 2.0 * lower), words
    )


def _range(values: list[float]) -> str:
    return f"{min(values, default=0.0):g}..{max(values, default=0.0):g}"


def _material(draft: RobotDraft, upper: float, assumed: dict[str, str]) -> dict[str, Any]:
    diameter = draft.diameter
    if diameter is None:
        diameter = float(np.sqrt(4.0 * upper / (np.pi * WORKING_STRESS)))
        words = f"{WORKING_STRESS / 1e6:g} MPa at the largest tension"
        _assume(assumed, "cable.diameter", diameter, words)
    modulus = draft.youngs_modulus
    if modulus is None:
        modulus = _assume(assumed, "cable.youngs_modulus", STEEL_ROPE_MODULUS, "steel wire rope")
    density = draft.linear_density
    if density is None:
        density = STEEL_DENSITY * np.pi * diameter**2 / 4.0
        _assume(assumed, "cable.linear_density", float(density), "solid steel of that diameter")
    _assume(assumed, "cable.retardation_time", RETARDATION, "a few per cent of critical damping")
    material = {
        "youngs_modulus": _float(modulus),
        "diameter": _float(diameter),
        "linear_density": _float(density),
        "retardation_time": RETARDATION,
    }
    if draft.breaking_load is not None:
        material["breaking_load"] = _float(draft.breaking_load)
    return material


def _pulley(draft: RobotDraft, assumed: dict[str, str]) -> float:
    if not draft.settle_pulleys():
        return float(_assume(assumed, "pulley.radius", 0.0, "fixed exit points"))
    return _float(draft.cables[0].pulley_radius or 0.0)


def _winch(draft: RobotDraft, assumed: dict[str, str]) -> dict[str, Any]:
    radius = draft.drum_radius
    if radius is None:
        radius = _assume(assumed, "winch.drum_radius", DRUM_RADIUS, "a common size")
    gear = draft.gear_ratio
    if gear is None:
        gear = _assume(assumed, "winch.gear_ratio", 1.0, "no gear")
    rpm = draft.motor_speed_rpm
    if rpm is None:
        speed = CABLE_SPEED if draft.cable_speed is None else draft.cable_speed
        rpm = speed / radius * gear * 30.0 / np.pi
        whose = "assumed" if draft.cable_speed is None else "given"
        _assume(
            assumed, "winch.motor_speed_rpm", float(rpm), f"for the {whose} {speed:g} m/s of cable"
        )
    winch: dict[str, Any] = {
        "drum_radius": _float(radius), "gear_ratio": _float(gear), "motor_speed_rpm": _float(rpm)
    }  # fmt: skip
    if draft.layers is not None:
        winch["layers"] = {key: _float(value) for key, value in draft.layers.items()}
    if draft.motor_inertia is not None:
        winch["inertia"] = _float(draft.motor_inertia)
    return winch


def _frame(
    draft: RobotDraft, assumed: dict[str, str], remarks: list[str], planar: bool
) -> tuple[Array, Array]:
    exits = draft.exit_points()
    low, high = exits.min(axis=1), exits.max(axis=1)
    if draft.frame_lower is not None and draft.frame_upper is not None:
        lower, upper = np.minimum(draft.frame_lower, low), np.maximum(draft.frame_upper, high)
        if np.any(lower < draft.frame_lower) or np.any(upper > draft.frame_upper):
            remarks.append("The frame was widened to hold all exit points.")
    else:
        lower, upper = low, high
        anchors = draft.anchor_points()
        reach = 2.0 * float(np.max(anchors.max(axis=1) - anchors.min(axis=1)))
        span = max(float(np.max((high - low)[:2])), reach) or float(high[2] - low[2]) or 1.0
        wide = np.array([reach, reach, 0.0])
        middle = (low + high) / 2.0
        lower, upper = (
            np.minimum(lower, middle - wide / 2.0),
            np.maximum(upper, middle + wide / 2.0),
        )
        if not planar and high[2] - low[2] < FLAT * span:
            lower = lower - np.array([0.0, 0.0, span])
        if draft.motion_type().is_plane and not planar:  # no wider across it than need be
            across = np.abs(draft.motion_type().axis) == 1.0
            lower[across], upper[across] = low[across], high[across]
        assumed["frame"] = (
            "the box round the exit points, twice as wide as the platform at least, as deep as "
            "wide where they lie in a plane"
        )
    if draft.plane_height is not None:
        lower[2], upper[2] = min(lower[2], draft.plane_height), max(upper[2], draft.plane_height)
    width = 0.05 * float(np.max(upper - lower))
    flat = upper - lower < width
    return np.where(flat, lower - width, lower), np.where(flat, upper + width, upper)


def _home(
    draft: RobotDraft,
    corners: tuple[Array, Array],
    bounds: tuple[float, float],
    gravity: float,
    assumed: dict[str, str],
) -> Array:
    """The given home position, or the pose of a grid that is farthest from the tension limits."""
    if draft.home_position is not None:
        return np.asarray(draft.home_position, float)
    middle = (corners[0] + corners[1]) / 2.0
    if draft.plane_height is not None:
        middle[2] = draft.plane_height
        return np.asarray(_assume(assumed, "home.position", middle, "the middle of the frame"))
    low, high = corners
    motion = draft.motion_type()
    if motion.rows is not None:  # the line or plane of the exit points
        still = [k for k in range(3) if 3 + k not in motion.rows]
        low, high = low.copy(), high.copy()
        low[still] = high[still] = (
            np.mean(draft.exit_points(), axis=1) if draft.origin is None else draft.origin
        )[still]
    grid = [
        low + (high - low) * np.array([x, y, z])
        for z in np.linspace(0.1, 0.9, 9)
        for x in np.linspace(0.2, 0.8, 5)
        for y in np.linspace(0.2, 0.8, 5)
    ]
    best, margin = _farthest(draft, grid, bounds, gravity)
    if margin < 0.0:
        words = "the middle of the frame; no pose of a grid over it is held within the limits"
        return np.asarray(_assume(assumed, "home.position", middle, words))
    words = "of a grid over the frame the pose whose tensions are farthest from the limits"
    return np.asarray(_assume(assumed, "home.position", grid[best], words))


def _farthest(
    draft: RobotDraft, grid: list[Array], bounds: tuple[float, float], gravity: float
) -> tuple[int, float]:
    """Number and margin [N] of the place where tensions that hold the platform upright are farthest
    from their limits; the margin is negative where it is held at none.
    """
    anchors, exits = draft.anchor_points(), draft.exit_points()
    com = np.zeros(3) if draft.center_of_mass is None else draft.center_of_mass
    force = (draft.mass or 0.0) * gravity * draft.down()
    motion, upright = draft.motion_type(), np.eye(3)
    w = motion.components(np.concatenate([np.cross(com, force), force]), upright)
    numbers, matrices = [], []
    for k, position in enumerate(grid):
        along = exits - position[:, np.newaxis] - anchors
        lengths = np.linalg.norm(along, axis=0)
        if np.any(lengths < 1e-9):
            continue
        u = along / lengths
        W = np.vstack([np.cross(anchors.T, u.T).T, u])
        numbers.append(k)
        matrices.append(motion.components(W, upright))
    if not numbers:
        return 0, -1.0
    best, margin = farthest_pose(np.array(matrices), w, bounds)
    return numbers[best], margin


def _cable(cable: Any, draft: RobotDraft) -> dict[str, Any]:
    item: dict[str, Any] = {
        "name": cable.name,
        "exit_point": _list(cable.exit_point),
        "anchor_point": _list(cable.anchor_point),
    }
    if cable.swivel_axis is not None and not np.allclose(cable.swivel_axis, [0, 0, 1], atol=1e-12):
        item["swivel_axis"] = _list(cable.swivel_axis)
    if cable.pulley_radius is not None and cable.pulley_radius != draft.cables[0].pulley_radius:
        item["pulley_radius"] = _float(cable.pulley_radius)
    if cable.anchor_pulley_radius is not None:
        item["anchor_pulley_radius"] = _float(cable.anchor_pulley_radius)
    if cable.anchor_swivel_axis is not None:
        item["anchor_swivel_axis"] = _list(cable.anchor_swivel_axis)
    if cable.material:
        item["material"] = {key: _float(value) for key, value in cable.material.items()}
    if cable.drum_radius is not None and cable.drum_radius != draft.drum_radius:
        item["drum_radius"] = _float(cable.drum_radius)
    if cable.mechanical_advantage not in (None, 1.0):
        item["mechanical_advantage"] = _float(cable.mechanical_advantage)
    return item


def _angles_deg(R: Array) -> Array:
    """Angles of R = Rx Ry Rz [deg]."""
    return np.degrees(-RollPitchYaw(RotationMatrix(R.T)).vector()) + 0.0


def _float(value: float) -> float:
    return float(value)


def _list(values: Any) -> list[float]:
    return [float(value) for value in np.asarray(values, float)]


def import_readme(name: str, source: str, tool: str, completed: CompletedDraft) -> str:
    """The README, as Markdown.

    Args:
        name: Name of the robot or mechanism.
        source: Name of the file that it came from.
        tool: The format of that file, in words.
        completed: What the file gave and lacked.
    """
    given = [f"- `{key}`" for key in completed.given]
    assumed = [f"| `{key}` | {words} |" for key, words in completed.assumed.items()]
    remarks = [f"- {words}" for words in completed.remarks] or ["- nothing"]
    return "\n".join(
        [
            f"# {name}", "", f"Imported from `{source}` ({tool}).",
            "", "## From the file", "", *given, "", "## Assumed, for the file lacks it", "",
            "| key | value |", "| --- | --- |", *assumed, "", "## Read otherwise or not kept",
            "", *remarks, "",
        ]
    )  # fmt: skip


def _to_a_point(draft: RobotDraft, remarks: list[str]) -> None:
    """Puts Po of a point mass where its cables hold it.

    A platform that does not turn is held alike by cables whose two ends are shifted together.
    """
    R = np.eye(3) if draft.R_WP is None else draft.R_WP
    anchors = draft.anchor_points()
    p_PQ = anchors[:, 0].copy()
    if np.ptp(anchors, axis=1).max() > SAME_POINT:
        p_PQ = np.zeros(3)
        remarks.append(
            f"Its cables hold a platform that does not turn, {draft.motion}, in several points; a "
            "point mass here has one, and got exit points that are shifted as much."
        )
        for cable in draft.cables:
            cable.exit_point = cable.exit_point - R @ cable.anchor_point
    for cable in draft.cables:
        cable.anchor_point = np.zeros(3)
    if np.any(p_PQ):
        remarks.append("Po was put into the point that holds the cables.")
        if draft.home_position is not None:
            draft.home_position = draft.home_position + R @ p_PQ
        if draft.plane_height is not None:
            draft.plane_height += float((R @ p_PQ)[2])
        if draft.box_center is not None:
            draft.box_center = draft.box_center - p_PQ
    if draft.center_of_mass is not None and np.any(draft.center_of_mass != p_PQ):
        remarks.append("The centre of mass of a point mass is the point that holds the cables.")
    draft.center_of_mass = np.zeros(3)


def _find_beam(draft: RobotDraft) -> None:
    """Gives a beam whose file does not name its axis that of the farthest anchor point from Po."""
    anchors = draft.anchor_points()
    reach = np.linalg.norm(anchors, axis=0)
    if draft.axis is None and np.max(reach) > 0.0:
        far = int(np.argmax(reach))
        draft.axis = anchors[:, far] / reach[far]
