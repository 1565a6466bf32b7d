"""Workspaces: grids of poses, what holds at each, volume and surface of where it holds.

A grid is a box of positions times a list of orientations. Volumes come by three rules, named in
every result.

Source: Gazebo thesis 2.6; servoing thesis 1.2.2 and 1.3.3.
"""

from cdpr_drake.workspaces.grid import (
    WorkspaceGrid,
    axis_by_count,
    axis_by_step,
    grid_by_count,
    grid_by_step,
)
from cdpr_drake.workspaces.static_feasibility import StaticCase, statically_feasible
from cdpr_drake.workspaces.surface import surface_quads, triangles
from cdpr_drake.workspaces.volume import VolumeRule, WorkspaceVolume, workspace_volume

__all__ = [
    "StaticCase", "VolumeRule", "WorkspaceGrid", "WorkspaceVolume", "axis_by_count",
    "axis_by_step", "grid_by_count", "grid_by_step", "statically_feasible", "surface_quads",
    "triangles", "workspace_volume",
]  # fmt: skip
