"""What is known of parameters beforehand, as equations in the unknown vector."""

from __future__ import annotations

from cdpr_drake.identification.parameters import (
    CENTER,
    COMPLIANCE,
    COULOMB,
    DAMPING,
    EXCESS,
    FRICTION,
    LAG,
    MASS_GROUP,
    MOMENTS,
    STIFFNESS,
    VISCOUS,
    DynamicModel,
    column,
)
from cdpr_drake.identification.regressor import MASS, SIZE

Prior = tuple[dict[int, float], float, float]
"""Factors by place in the vector, what they make of it, and its standard deviation."""


def prior_rows(model: DynamicModel, group: str, std: float) -> list[Prior]:
    """A group of parameters known as a model has them, see `IdentificationProgram.AddPrior`."""
    believed, cables = model.vector(), range(len(model.names))
    if group == MASS_GROUP:
        return [({MASS: 1.0}, believed[MASS], std)]
    if group == CENTER:
        center = model.center_of_mass / model.mass
        return [({1 + j: 1.0 / model.mass, MASS: -float(center[j])}, 0.0, std) for j in range(3)]
    if group == MOMENTS:
        return [({k: 1.0}, believed[k], std) for k in range(4, SIZE)]
    if group == STIFFNESS:
        places = [(column(i, COMPLIANCE), float(model.stiffness[i])) for i in cables]
        return [({k: 1.0}, believed[k], std / EA**2) for k, EA in places]
    if group == DAMPING:
        pairs = [(i, float(model.stiffness[i]), float(model.retardation[i])) for i in cables]
        return [
            ({column(i, LAG): EA, column(i, COMPLIANCE): -T * EA}, 0.0, std) for i, EA, T in pairs
        ]
    what = (COULOMB, VISCOUS) if group == FRICTION else (EXCESS,)
    return [
        ({k: 1.0}, believed[k], std) for k in (column(i, each) for i in cables for each in what)
    ]
