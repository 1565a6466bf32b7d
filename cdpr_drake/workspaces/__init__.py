"""Workspaces: grids of poses, what holds at each, volume and surface of where it holds.

`regions` has grids, volumes and surfaces; `wrenches` what cables can hold, resist and accelerate;
`conditions` stiffness, vibrations and dexterity; `interference` what cables and platform meet;
`certificate` proofs for whole boxes of poses.
Functions take arrays of poses and any number of rows that the platform can move.

Source: Gazebo thesis 2.6; servoing thesis 1.2.2 and 1.3.3.
"""

from cdpr_drake.workspaces.certificate import (
    INSIDE,
    OPEN,
    OUTSIDE,
    BoxAgreement,
    BoxJournal,
    CertifiedBoxes,
    CertifiedKind,
    CertifyTask,
    PoseBox,
    certify,
    grid_agreement,
    hull_agreement,
)
from cdpr_drake.workspaces.conditions import (
    REGULAR,
    StiffnessAtPoses,
    dexterities,
    first_frequencies,
    stiffness_at,
    tension_factors,
)
from cdpr_drake.workspaces.interference import (
    PART_NAMES,
    Surroundings,
    beams,
    box_row,
    clearances,
    segment_box_distance,
    segments_shares,
)
from cdpr_drake.workspaces.regions import (
    FIRST_STEPS,
    GRID_ENDINGS,
    MESH_ENDINGS,
    VolumeRule,
    WorkspaceGrid,
    WorkspaceHull,
    WorkspaceVolume,
    axis_by_count,
    axis_by_step,
    cell_hull_share,
    grid_by_count,
    grid_by_step,
    mesh_ending,
    surface_quads,
    triangles,
    workspace_hull,
    workspace_volume,
    write_cells,
    write_hull,
)
from cdpr_drake.workspaces.wrenches import (
    AvailableWrenches,
    CapacityMargins,
    Demand,
    MotionDemand,
    SpatialSet,
    StaticCase,
    accelerating,
    available_wrenches,
    capacity_margins,
    closure_margins,
    held_by_method,
    largest_payloads,
    margin_slopes,
    resisting,
    scaled_matrices,
    statically_feasible,
    weight_wrenches,
)

__all__ = [
    "FIRST_STEPS", "GRID_ENDINGS", "INSIDE", "MESH_ENDINGS", "OPEN", "OUTSIDE", "PART_NAMES",
    "REGULAR", "AvailableWrenches", "BoxAgreement", "BoxJournal", "CapacityMargins",
    "CertifiedBoxes", "CertifiedKind", "CertifyTask", "Demand", "MotionDemand", "PoseBox",
    "SpatialSet", "StaticCase", "StiffnessAtPoses", "Surroundings", "VolumeRule", "WorkspaceGrid",
    "WorkspaceHull", "WorkspaceVolume", "accelerating", "available_wrenches", "axis_by_count",
    "axis_by_step", "beams", "box_row", "capacity_margins", "cell_hull_share", "certify",
    "clearances", "closure_margins", "dexterities", "first_frequencies", "grid_agreement",
    "grid_by_count", "grid_by_step", "held_by_method", "hull_agreement", "largest_payloads",
    "margin_slopes", "mesh_ending", "resisting", "scaled_matrices", "segment_box_distance",
    "segments_shares", "statically_feasible", "stiffness_at", "surface_quads", "tension_factors",
    "triangles", "weight_wrenches", "workspace_hull", "workspace_volume", "write_cells",
    "write_hull",
]  # fmt: skip
