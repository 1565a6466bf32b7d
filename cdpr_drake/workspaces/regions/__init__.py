"""Grids of poses over a box; volume and surface of the part where something holds.

A grid is a box of positions times a list of orientations. Volumes come by three rules, named in
every result.

Source: servoing thesis 1.3.3.
"""

from cdpr_drake.workspaces.regions.grid import (
    WorkspaceGrid,
    axis_by_count,
    axis_by_step,
    grid_by_count,
    grid_by_step,
)
from cdpr_drake.workspaces.regions.hull import FIRST_STEPS, WorkspaceHull, workspace_hull
from cdpr_drake.workspaces.regions.mesh_files import (
    GRID_ENDINGS,
    MESH_ENDINGS,
    mesh_ending,
    write_cells,
    write_hull,
)
from cdpr_drake.workspaces.regions.surface import surface_quads, triangles
from cdpr_drake.workspaces.regions.volume import (
    VolumeRule,
    WorkspaceVolume,
    cell_hull_share,
    workspace_volume,
)

__all__ = [
    "FIRST_STEPS", "GRID_ENDINGS", "MESH_ENDINGS", "VolumeRule", "WorkspaceGrid", "WorkspaceHull",
    "WorkspaceVolume", "axis_by_count", "axis_by_step", "cell_hull_share", "grid_by_count",
    "grid_by_step", "mesh_ending", "surface_quads", "triangles", "workspace_hull",
    "workspace_volume", "write_cells", "write_hull",
]  # fmt: skip
