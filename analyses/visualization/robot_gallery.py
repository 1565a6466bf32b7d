"""Robots side by side on one page that needs no server, no scripts and no network."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from cdpr_drake.analyses.visualization.solids import VIEW
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import COLORS, OUTLINE, PLATFORM, rgb

WIDTH, HEIGHT, MARGIN = 280.0, 210.0, 14.0
"""Of a thumbnail, and what is left free around the robot [px]."""

FLAT = 1e-6
"""Robots whose cables are this near to one height [m] are seen from above."""

_CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
_EDGES = [
    (i, j) for i in range(8) for j in range(i) if np.abs(_CORNERS[i] - _CORNERS[j]).sum() == 1.0
]
_FACES = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
"""Corners of a box's faces: at the low and at the high end of x, then of y, then of z."""

_SHADES = (0.55, 0.75, 0.65)
"""Brightness of the platform's faces along x, y and z."""

_STYLE = f"""
body {{ font: 15px/1.4 system-ui, sans-serif; margin: 1.5rem; color: #202020; background: #fff; }}
main {{ display: grid; gap: 1rem; grid-template-columns: repeat(auto-fill, minmax(300px, 1fr)); }}
article {{ border: 1px solid #c8c8c8; border-radius: 4px; padding: 0.6rem 0.8rem; }}
h2 {{ font-size: 1rem; margin: 0; overflow-wrap: anywhere; }}
p {{ margin: 0.2rem 0; font-size: 0.86rem; }}
svg {{ display: block; width: 100%; height: auto; }}
.frame {{ stroke: {OUTLINE.color}; stroke-width: 1; stroke-dasharray: 4 3; fill: none; }}
.cable {{ stroke-width: 1.6; fill: none; }}
.exit {{ fill: #202020; }}
.face {{ stroke: #101010; stroke-width: 0.8; stroke-linejoin: round; fill-opacity: 0.8; }}
"""


def gallery_page(robots: Sequence[Robot], title: str = "Robots") -> str:
    """One HTML page with a thumbnail and facts of each robot, in their order.

    A thumbnail shows the robot at its home pose: frame (dashed), exit points (triangles), cables,
    and the platform's box, in an orthographic view; robots in a horizontal plane from above.

    Args:
        robots: The robots.
        title: Heading of the page.
    """
    articles = "\n".join(_article(robot) for robot in robots)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head>\n"
        f"<body><h1>{escape(title)}</h1>\n<main>\n{articles}\n</main></body></html>\n"
    )


def _article(robot: Robot) -> str:
    lower, upper = robot.frame.lower, robot.frame.upper
    size = " x ".join(f"{edge:.3g}" for edge in upper - lower)
    low, high = robot.tension_limits()
    facts = (
        f"{robot.motion}, {len(robot.cables)} cables, platform {robot.platform.mass:g} kg, "
        f"frame {size} m, tensions {low:g} to {high:g} N"
    )
    return (
        f"<article><h2>{escape(robot.name)}</h2>{thumbnail(robot)}"
        f"<p>{escape(robot.title)}</p><p>{escape(facts)}</p></article>"
    )


def thumbnail(robot: Robot) -> str:
    """A robot at its home pose as an SVG element."""
    cables, X_WP = robot.cable_set(), robot.home.transform()
    lower, upper = np.asarray(robot.frame.lower), np.asarray(robot.frame.upper)
    anchors = X_WP.multiply(cables.p_PB)
    box_P = robot.box_center() + (_CORNERS - 0.5) * np.asarray(robot.platform.size)
    points = [(lower + _CORNERS * (upper - lower)).T, cables.p_WA, anchors, X_WP.multiply(box_P.T)]
    flat = np.ptp(np.concatenate([cables.p_WA[2], anchors[2]])) < FLAT
    toward, view = _view(bool(flat))
    # Into the middle of the picture, as large as its margins allow [px].
    seen = view @ np.hstack(points)
    low, high = seen.min(axis=1), seen.max(axis=1)
    size = np.array([WIDTH, HEIGHT])
    scale = float(np.min((size - 2.0 * MARGIN) / np.maximum(high - low, 1e-9)))
    frame, exits, ends, box = (
        0.5 * size + scale * ((view @ each).T - 0.5 * (low + high)) for each in points
    )
    edges = "".join(f"M{_at(frame[i])}L{_at(frame[j])}" for i, j in _EDGES)
    lines = [f'<path class="frame" d="{edges}"/>']
    for index, (start, end) in enumerate(zip(exits, ends, strict=True)):
        color = COLORS[index % len(COLORS)]
        lines.append(f'<path class="cable" stroke="{color}" d="M{_at(start)}L{_at(end)}"/>')
    lines += _box_faces(box, X_WP.rotation().matrix().T @ toward)
    lines += [f'<path class="exit" d="M{x:.1f} {y - 4:.1f}l4 7h-8z"/>' for x, y in exits]
    title = escape(f"{robot.name} at its home pose")
    return (
        f'<svg viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img"><title>{title}</title>'
        f"{''.join(lines)}</svg>"
    )


def _view(flat: bool) -> tuple[Array, Array]:
    """Direction towards the viewer, shape (3,), and rows to the right and down, shape (2, 3)."""
    if flat:
        return np.array([0.0, 0.0, 1.0]), np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    up, around = np.radians(VIEW)
    toward = np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])
    right = np.array([-np.sin(around), np.cos(around), 0.0])
    return toward, np.array([right, -np.cross(toward, right)])


def _at(point: Array) -> str:
    return f"{point[0]:.1f} {point[1]:.1f}"


def _box_faces(corners: Array, toward_P: Array) -> list[str]:
    """The faces of the platform that are seen; toward_P is the viewer's direction in P."""
    faces = []
    for axis in range(3):
        if abs(toward_P[axis]) > 1e-9:
            face = _FACES[2 * axis + (1 if toward_P[axis] > 0.0 else 0)]
            outline = "L".join(_at(corners[corner]) for corner in face)
            share = _SHADES[axis]  # 0: the platform's colour, 1: white
            color = "#" + "".join(
                f"{round(255.0 * (c + share * (1.0 - c))):02x}" for c in rgb(PLATFORM.color)
            )
            faces.append(f'<path class="face" fill="{color}" d="M{outline}Z"/>')
    return faces
