"""Workspaces in the robot's scene, as a page for the browser."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydrake.geometry import Rgba

from cdpr_drake.analyses.pictures import RobotPicture
from cdpr_drake.analyses.workspaces.results import ALL, RobotWorkspace
from cdpr_drake.errors import CdprError
from cdpr_drake.models import Robot
from cdpr_drake.workspaces import surface_quads, triangles

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


def write_workspace_scene(folder: Path, workspace: RobotWorkspace, robot: Robot) -> str:
    """Writes the robot at home with its workspaces into a folder that exists, as one page.

    Every kind is an entry below "workspaces" in the page's menu, where it can be shown and hidden;
    what they have in common is visible. Cables are drawn without tension.

    Returns:
        Why there is no page; empty if there is.
    """
    try:
        picture = RobotPicture(robot, 0.0)
        picture.draw(robot.home.transform(), np.zeros(len(robot.cables)))
    except CdprError as problem:
        return f"{PAGE} is left out, the robot cannot be drawn at home: {problem}"
    names = [ALL, *workspace.holds] if len(workspace.holds) > 1 else list(workspace.holds)
    for number, name in enumerate(names):
        quads = surface_quads(workspace.places(name), workspace.grid.axes)
        if not len(quads):
            continue
        vertices, faces = triangles(quads)
        path = f"workspaces/{name}"
        color = COLORS[min(number, len(COLORS) - 1)]
        picture.meshcat.SetTriangleMesh(path, vertices.T, np.asarray(faces.T, np.int32), color)
        picture.meshcat.SetProperty(path, "visible", number == 0)
    (folder / PAGE).write_text(picture.html(), encoding="utf-8")
    return ""
