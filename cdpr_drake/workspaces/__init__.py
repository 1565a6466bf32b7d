"""Workspaces: grids of poses, what holds at each, volume and surface of where it holds.

`regions` has grids, volumes and surfaces, `wrenches` what cables can hold.

Source: Gazebo thesis 2.6; servoing thesis 1.2.2 and 1.3.3.
"""

from cdpr_drake.workspaces.regions import (
    VolumeRule,
    WorkspaceGrid,
    WorkspaceVolume,
    axis_by_count,
    axis_by_step,
    grid_by_count,
    grid_by_step,
    surface_quads,
    triangles,
    workspace_volume,
)
from cdpr_drake.workspaces.wrenches import StaticCase, statically_feasible

__all__ = [
    "StaticCase", "VolumeRule", "WorkspaceGrid", "WorkspaceVolume", "axis_by_count",
    "axis_by_step", "grid_by_count", "grid_by_step", "statically_feasible", "surface_quads",
    "triangles", "workspace_volume",
]  # fmt: skip
