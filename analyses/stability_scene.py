"""Control stability workspaces in the robot's scene, as a page for the browser."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydrake.geometry import Rgba

from cdpr_drake.analyses.replay import robot_picture
from cdpr_drake.analyses.stability_workspaces import StabilityWorkspaces
from cdpr_drake.models import Robot
from cdpr_drake.workspace_surface import surface_quads, triangles

PAGE = "workspace.html"
"""The page."""

SOLIDS = {
    "SZ": Rgba(0.25, 0.56, 0.37, 0.55),
    "Z": Rgba(0.48, 0.65, 0.85, 0.45),
    "S": Rgba(0.94, 0.76, 0.48, 0.45),
}
"""Kinds with their colours; the first is visible, the others wait in the menu."""


def workspace_html(workspaces: StabilityWorkspaces, robot: Robot) -> str:
    """The robot at home with its workspaces as one page that needs no server.

    Every workspace is an entry below "workspaces" in the page's menu, where it can be shown and
    hidden; SZ of the first bounds is visible.

    Raises:
        InfeasibleTensionError: The home pose cannot be held.
    """
    picture = robot_picture(robot)
    for number, name in enumerate(workspaces.names):
        for kind, color in SOLIDS.items():
            if kind == "S" and number > 0:
                continue  # the same for all bounds
            quads = surface_quads(workspaces.places(kind, name), workspaces.grid.axes)
            if not len(quads):
                continue
            vertices, faces = triangles(quads)
            path = f"workspaces/{name}/{kind}" if kind != "S" else "workspaces/S"
            picture.meshcat.SetTriangleMesh(path, vertices.T, np.asarray(faces.T, np.int32), color)
            picture.meshcat.SetProperty(path, "visible", number == 0 and kind == "SZ")
    return picture.html()


def write_scene(folder: Path, workspaces: StabilityWorkspaces, robot: Robot) -> Path:
    """Writes the page into a folder that exists; raises as `workspace_html`."""
    path = folder / PAGE
    path.write_text(workspace_html(workspaces, robot), encoding="utf-8")
    return path
