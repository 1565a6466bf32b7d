"""Solids in a robot's frame, as workspaces are drawn: in a figure, and in Meshcat.

`draw_solid` draws one in a figure, `add_solid` in Meshcat. `see_through` and `transparent_paths`
are for what is transparent there.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.geometry import Meshcat, Rgba, Role, SceneGraphInspector

from cdpr_drake.arrays import Array
from cdpr_drake.palette import OUTLINE

if TYPE_CHECKING:
    from matplotlib.lines import Line2D

VIEW = 22.0, -58.0
"""Elevation and azimuth from which solids are seen [deg]."""

NO_CELL = "no cell of the grid has\nall its corners inside"
"""In a frame without a solid: single poses may be inside."""


def draw_solid(
    axes: Any, quads: Array, color: str, frame: tuple[Array, Array], exits: Array
) -> list[Line2D]:
    """A solid in the frame of a robot, in true proportions.

    Args:
        axes: Of projection 3d, with computed_zorder off.
        quads: Corners of its faces, shape (k, 4, 3) [m]; k may be 0.
        color: Of the solid.
        frame: Lower and upper corner, shape (3,) each [m].
        exits: Exit points of the cables, shape (3, m) [m].

    Returns:
        What a legend may name: exit points, frame.
    """
    from matplotlib.colors import LightSource  # heavy, and a scene in Meshcat needs none of it
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    from cdpr_drake.analyses.visualization.path_figures import set_box

    if len(quads):
        light = LightSource(azdeg=200.0, altdeg=45.0)
        axes.add_collection3d(
            Poly3DCollection(
                quads, facecolors=color, edgecolors=color, linewidths=0.2, zorder=2, shade=True,
                lightsource=light,
            )
        )  # fmt: skip
    else:
        axes.text2D(
            0.5, 0.5, NO_CELL, transform=axes.transAxes, ha="center", va="center", fontsize=9,
            zorder=6, bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5, "alpha": 0.85},
        )  # fmt: skip
    edge = _draw_frame(axes, *frame)
    handles = [*axes.plot(*exits, "k^", markersize=4, zorder=4, label="exit points of the cables")]
    set_box(axes, *frame, zoom=0.7)  # labels of narrow panels need room
    axes.xaxis.labelpad, axes.zaxis.labelpad = 11.0, 9.0
    axes.view_init(*VIEW)
    return [*handles, edge]


def _draw_frame(axes: Any, lower: Array, upper: Array) -> Line2D:
    """The twelve edges of the frame, edges at the nearest corner before the solid; one of them."""
    elevation, azimuth = np.radians(VIEW)
    nearest = np.where([np.cos(azimuth) > 0, np.sin(azimuth) > 0, elevation > 0], upper, lower)
    for along in range(3):
        u, v = (along + 1) % 3, (along + 2) % 3
        for a, b in product((lower, upper), repeat=2):
            edge = np.empty((3, 2))
            edge[along] = lower[along], upper[along]
            edge[u], edge[v] = a[u], b[v]
            near = a[u] == nearest[u] and b[v] == nearest[v]
            (line,) = axes.plot(
                *edge, color=OUTLINE.color, linewidth=0.8, zorder=3 if near else 1, label="frame"
            )
    return line


VISUALIZER = "visualizer"
"""Prefix of what Drake's `MeshcatVisualizer` shows."""


def add_solid(
    meshcat: Meshcat, path: str, vertices: Array, faces: np.ndarray, color: Rgba, *,
    visible: bool = True,
) -> None:  # fmt: skip
    """Shows triangles in W.

    Args:
        meshcat: Meshcat.
        path: Path in its tree.
        vertices: Shape (n, 3) [m].
        faces: Numbers of the corners of each triangle, shape (k, 3).
        color: With its opacity.
        visible: True to show them; else they wait in the menu.
    """
    corners = np.asarray(faces.T, np.int32)
    meshcat.SetTriangleMesh(path, np.asarray(vertices.T, float), corners, color)
    if color.a() < 1.0:
        see_through(meshcat, path)
    meshcat.SetProperty(path, "visible", visible)


def see_through(meshcat: Meshcat, path: str) -> None:
    """Lets the one mesh at a path, which is transparent, be seen through wherever it is.

    Meshcat's materials write their depth also where they are transparent (`depthWrite`, of
    three.js). Of two faces of a solid that lie behind each other, the farther one is then seen only
    if its triangle happens to be drawn first: there are dark triangles, patches of two layers,
    which are darker, with ragged edges. Without it every layer is seen, whatever the order, and
    other solids behind are, too.
    """
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
