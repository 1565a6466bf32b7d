"""A workspace as grid, hull and boxes in the robot's scene, as a page for the browser."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import Rgba

from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.visualization.replay import RobotPicture
from cdpr_drake.analyses.visualization.solids import add_solid
from cdpr_drake.analyses.workspaces.stability_scene import held_picture, home_tensions
from cdpr_drake.analyses.workspaces.workspace_results import ALL, RobotWorkspace
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.workspaces.box_expansion_kernel import INSIDE, OPEN, OUTSIDE
from cdpr_drake.workspaces.certified_boxes import CertifiedBoxes
from cdpr_drake.workspaces.hull import WorkspaceHull
from cdpr_drake.workspaces.volume import surface_quads, triangles

PAGE = "workspace.html"
"""The page."""

COLORS = (
    Rgba(0.25, 0.56, 0.37, 0.55),
    Rgba(0.48, 0.65, 0.85, 0.45),
    Rgba(0.94, 0.76, 0.48, 0.45),
    Rgba(0.80, 0.47, 0.65, 0.45),
    Rgba(0.60, 0.60, 0.60, 0.45),
)
"""Of what all kinds have in common, then of the kinds in turn."""

HULL_COLOR = Rgba(0.48, 0.65, 0.85, 0.45)

MOST_BOXES = 3000
"""So many boxes of each verdict are drawn, the largest."""

VERDICTS = {
    "inside": (INSIDE, Rgba(0.25, 0.56, 0.37, 0.35)),
    "outside": (OUTSIDE, Rgba(0.75, 0.35, 0.25, 0.25)),
    "open": (OPEN, Rgba(0.35, 0.35, 0.35, 0.6)),
}
"""Boxes by what is proven of them, and their colours."""


def workspace_page(
    workspace: RobotWorkspace,
    robot: Robot,
    hull: WorkspaceHull | None = None,
    boxes: CertifiedBoxes | None = None,
) -> tuple[Pictures, str]:
    """What writes the robot at home with its workspaces as one page; else why there is none.

    Every kind, the hull, and boxes by what is proven of them are entries below "workspaces" in the
    page's menu, where they can be shown and hidden; what all kinds have in common is visible.
    Cables have the tensions that hold the robot at home with the limits, mass and wrench of the
    question; where none do, they are grey, and the words say why.
    """
    tensions, problem = home_tensions(workspace.arguments["statics"], robot)
    note = f"the cables in {PAGE} are grey: {problem}" if problem else ""
    try:
        picture = held_picture(robot, tensions)
    except CdprError as there:
        return {}, f"{PAGE} is left out, the robot cannot be drawn at home: {there}"
    about = workspace.arguments
    picture.title = f"{about['robot']}: workspaces, {workspace.geometry}"
    for number, (name, solid, color) in enumerate(workspace_solids(workspace)):
        if len(solid[1]):
            path = f"workspaces/{name}"
            add_solid(picture.meshcat, path, *solid, color, visible=number == 0)
    if hull is not None:
        _add(picture, "workspaces/hull", *hull_solid(hull))
    if workspace.is_tilted():
        picture.title = f"axes: {workspace.axes_words()}"
    if boxes is not None:
        for name, words, solid, color in box_solids(boxes):
            _add(picture, f"workspaces/boxes/{name}, {words}", solid, color)
    return {PAGE: lambda path: path.write_text(picture.html(), encoding="utf-8")}, note


def workspace_solids(
    workspace: RobotWorkspace,
) -> list[tuple[str, tuple[Array, np.ndarray], Rgba]]:
    """What all kinds have in common, where there are several, and each kind: name, solid, colour.

    A solid is vertices, shape (n, 3) [m], and triangles, shape (k, 3); none of an empty one.
    """
    names = [ALL, *workspace.holds] if len(workspace.holds) > 1 else list(workspace.holds)
    return [
        (
            name,
            triangles(surface_quads(workspace.places(name), workspace.grid.axes)),
            COLORS[min(number, len(COLORS) - 1)],
        )
        for number, name in enumerate(names)
    ]


def hull_solid(hull: WorkspaceHull) -> tuple[tuple[Array, np.ndarray], Rgba]:
    """A hull as vertices and triangles, and its colour."""
    return (hull.vertices, hull.faces), HULL_COLOR


def box_solids(
    boxes: CertifiedBoxes,
) -> list[tuple[str, str, tuple[Array, np.ndarray], Rgba]]:
    """Boxes by what is proven of them: name of that, words, solid of the largest, colour.

    A verdict without a box is left out.
    """
    found = []
    for name, (verdict, color) in VERDICTS.items():
        some = np.flatnonzero(boxes.verdicts == verdict)
        volumes = np.prod(np.where(boxes.halves > 0.0, boxes.halves, 1.0)[some], axis=1)
        largest = some[np.argsort(-volumes, kind="stable")[:MOST_BOXES]]
        if len(largest):
            words = f"the largest {len(largest)} of {len(some)}"
            solid = _cuboids(boxes.poses[largest, :3], boxes.halves[largest, :3])
            found.append((name, words, solid, color))
    return found


def _add(picture: RobotPicture, path: str, solid: tuple[Array, np.ndarray], color: Rgba) -> None:
    """Adds triangles that wait in the menu."""
    add_solid(picture.meshcat, path, *solid, color, visible=False)


def _cuboids(middles: Array, halves: Array) -> tuple[Array, np.ndarray]:
    """Vertices, shape (8 k, 3), and triangles, shape (12 k, 3), of boxes."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    one = np.array([(a, b, c) for a, b, c, _ in quads] + [(a, c, d) for a, _, c, d in quads])
    vertices = (middles[:, np.newaxis] + halves[:, np.newaxis] * signs).reshape(-1, 3)
    faces = one + 8 * np.arange(len(middles))[:, np.newaxis, np.newaxis]
    return vertices, faces.reshape(-1, 3)
