"""What a robot is built of beside its points: materials, pulleys, shapes, rails, winches.

Schemas of sections of a robot file, and what follows from several of them together.
"""

from cdpr_drake.models.hardware.materials import (
    CableMaterial,
    OwnMaterial,
    check_materials,
    given_material,
    own_material,
)
from cdpr_drake.models.hardware.pulleys import PlatformPulley, Pulley
from cdpr_drake.models.hardware.rails import MARK, Rail, check_rail, split_name
from cdpr_drake.models.hardware.shape_checks import check_shapes
from cdpr_drake.models.hardware.shapes import MESH, Frame, FrameBeam, PlatformShape, mesh_files
from cdpr_drake.models.hardware.winches import Winch

__all__ = [
    "MARK", "MESH", "CableMaterial", "Frame", "FrameBeam", "OwnMaterial", "PlatformPulley",
    "PlatformShape", "Pulley", "Rail", "Winch", "check_materials", "check_rail", "check_shapes",
    "given_material", "mesh_files", "own_material", "split_name",
]  # fmt: skip
