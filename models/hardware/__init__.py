"""What a robot is built of beside its points: materials of cables, pulleys at the platform, shapes.

Schemas of sections of a robot file, and what follows from several of them together.
"""

from cdpr_drake.models.hardware.materials import (
    CableMaterial,
    OwnMaterial,
    given_material,
    own_material,
)
from cdpr_drake.models.hardware.pulleys import PlatformPulley
from cdpr_drake.models.hardware.shape_checks import check_shapes
from cdpr_drake.models.hardware.shapes import FrameBeam, PlatformShape

__all__ = [
    "CableMaterial", "FrameBeam", "OwnMaterial", "PlatformPulley", "PlatformShape", "check_shapes",
    "given_material", "own_material",
]  # fmt: skip
