"""What a robot is built of beside its points: materials of cables.

Schemas of sections of a robot file, and what follows from several of them together.
"""

from cdpr_drake.models.hardware.materials import (
    CableMaterial,
    OwnMaterial,
    given_material,
    own_material,
)

__all__ = ["CableMaterial", "OwnMaterial", "given_material", "own_material"]
