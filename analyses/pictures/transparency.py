"""Solids that are seen through, without the dark triangles that Meshcat would show in them.

Meshcat's materials write their depth also where they are transparent (`depthWrite`, of three.js).
Of two faces of a solid that lie behind each other, the farther one is then seen only if its
triangle happens to be drawn first: patches of two layers, which are darker, with ragged edges.
Without it every layer is seen, whatever the order, and other solids behind are, too.
"""

from __future__ import annotations

import numpy as np
from pydrake.geometry import Meshcat, Rgba, Role, SceneGraphInspector

from cdpr_drake.arrays import Array

VISUALIZER = "visualizer"
"""Prefix of what Drake's `MeshcatVisualizer` shows."""


def add_solid(
    meshcat: Meshcat,
    path: str,
    vertices: Array,
    faces: np.ndarray,
    color: Rgba,
    *,
    visible: bool = True,
) -> None:
    """Shows triangles in W.

    Args:
        meshcat: Where.
        path: In its tree.
        vertices: Shape (n, 3) [m].
        faces: Numbers of the corners of each triangle, shape (k, 3).
        color: With its opacity.
        visible: Whether they are shown, or wait in the menu.
    """
    corners = np.asarray(faces.T, np.int32)
    meshcat.SetTriangleMesh(path, np.asarray(vertices.T, float), corners, color)
    if color.a() < 1.0:
        see_through(meshcat, path)
    meshcat.SetProperty(path, "visible", visible)


def see_through(meshcat: Meshcat, path: str) -> None:
    """Lets the one mesh at a path, which is transparent, be seen through wherever it is."""
    meshcat.SetProperty(f"{path}/<object>", "material.depthWrite", False)
    # Its shadow would be that of something solid.
    meshcat.SetProperty(f"{path}/<object>", "castShadow", False)


def transparent_paths(inspector: SceneGraphInspector) -> list[str]:
    """Where Drake's `MeshcatVisualizer` shows geometries whose colour is transparent."""
    paths = []
    for geometry in inspector.GetAllGeometryIds(Role.kIllustration):
        properties = inspector.GetIllustrationProperties(geometry)
        if properties is None or not properties.HasProperty("phong", "diffuse"):
            continue
        if properties.GetProperty("phong", "diffuse").a() >= 1.0:
            continue
        frame, parts = inspector.GetFrameId(geometry), [VISUALIZER]
        if frame != inspector.world_frame_id():
            parts.append(inspector.GetName(frame))
        parts.append(inspector.GetName(geometry))
        paths.append("/".join(parts).replace("::", "/"))
    return paths
