"""Cable models by name: what each assumes of a cable, and which cables it can describe."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cdpr_drake.cables.cable_behaviour import behaviour_of
from cdpr_drake.errors import CableModelError, accepted_names
from cdpr_drake.geometry.cable_set import CableSet

if TYPE_CHECKING:
    from cdpr_drake.geometry.cable_routes import CableRoutes

STRAIGHT, HANGING, BEHAVING = range(3)
"""Laws: a straight spring that only pulls, an elastic cable that sags under its own weight, and a
straight one that does what `cable_behaviour` says. A cable without weight is straight by the
second, too."""

INEXTENSIBLE, ELASTIC, KELVIN_VOIGT, CATENARY = (
    "inextensible",
    "elastic",
    "kelvin_voigt",
    "catenary",
)


@dataclass(frozen=True)
class CableModel:
    """A cable model, as `CABLE_MODELS` has it by name.

    Attributes:
        title: What it assumes of a cable.
        law: Number of its law in `dispatch_kernel`, by which kernels compute.
        sags: Whether a cable has a curve of its own and needs tension to carry its weight.
        damped: Whether the cables' retardation times count.
        extensible: Whether its tension follows from its length.
    """

    title: str
    law: int = STRAIGHT
    sags: bool = False
    damped: bool = True
    extensible: bool = True


CABLE_MODELS: dict[str, CableModel] = {
    INEXTENSIBLE: CableModel(
        "straight, massless, of fixed length; statics decide on its tension",
        damped=False, extensible=False,
    ),
    ELASTIC: CableModel("straight, massless spring that only pulls", damped=False),
    KELVIN_VOIGT: CableModel("the same with viscous damping while it is taut"),
    CATENARY: CableModel(
        "elastic, sags under its own weight, damped along its end", HANGING, sags=True
    ),
}  # fmt: skip
"""The models by name. Each may run over pulleys: that is a matter of the set's `pulley_radius`. A
further one is a row, and for a law of its own also what `dispatch_kernel` lists."""


def cable_law(model: str, cables: CableSet) -> int:
    """Number of the law that kernels compute cables of a model by, see `dispatch_kernel`."""
    return BEHAVING if cables.beyond.size else CABLE_MODELS[model].law


def check_model(model: str, cables: CableSet) -> None:
    """Checks that a model is known and can describe these cables.

    Raises:
        CableModelError: It is not, or a sagging cable has a swivel axis that is not vertical, or
            hangs in a frame where gravity does not point along -z, or cables do what this model
            does not, see `CableSet.beyond`.
    """
    if model not in CABLE_MODELS:
        raise CableModelError(
            f"cable model: found {model!r}; {accepted_names(model, CABLE_MODELS)}"
        )
    if cables.beyond.size:
        _check_beyond(model, cables)
    if CABLE_MODELS[model].sags:
        if cables.has_platform_pulleys():
            i = int(np.argmax(cables.anchor_pulley_radius > 0.0))
            raise CableModelError(
                f"anchor_pulley_radius of cable {i + 1}: found {cables.anchor_pulley_radius[i]:g}; "
                "accepted for the catenary: 0 [m], since a cable that sags is solved with a pulley "
                "at its exit point only"
            )
        if np.any(cables.arm > 0.0):
            raise CableModelError(
                f"arm of cable {int(np.argmax(cables.arm)) + 1}: found {np.max(cables.arm):g}; "
                "accepted for the catenary: 0 [m], since a cable that sags is solved from a point "
                "or a pulley"
            )
        if cables.down[2] > -1.0 + 1e-12 and np.any(cables.linear_weight > 0.0):
            raise CableModelError(
                f"cable model: found {model} with gravity along {np.round(cables.down, 6)} of the "
                "frame that the cables are computed in, of a line or a plane that of its joint; "
                "accepted: gravity along (0, 0, -1), or straight cables"
            )
        tilted = (cables.pulley_radius > 0.0) & (np.abs(cables.swivel_axis[2]) < 1.0 - 1e-12)
        if np.any(tilted):
            i = int(np.argmax(tilted))
            raise CableModelError(
                f"swivel_axis of cable {i + 1}: found {cables.swivel_axis[:, i]}; accepted for "
                "the catenary: (0, 0, 1) or (0, 0, -1), so that groove and cable share a plane"
            )


def _check_beyond(model: str, cables: CableSet) -> None:
    kind = CABLE_MODELS[model]
    if kind.sags or not kind.extensible:
        raise CableModelError(
            f"cable model: found {model} for cables with a behaviour beside the elastic law, see "
            "cable.behaviour; accepted: elastic, kelvin_voigt"
        )
    friction = behaviour_of(cables).sheave_friction
    if friction > 0.0 and cables.has_platform_pulleys():
        raise CableModelError(
            f"cable.behaviour.sheave_friction: found {friction:g} with pulleys at the platform; "
            "accepted: 0, or pulleys at the exit points only"
        )


def check_routes(model: str, routes: CableRoutes) -> None:
    """Checks that a model is known and can describe cables between bodies.

    Raises:
        CableModelError: As `check_model`; or a cable that sags runs over eyelets, or leaves a
            moving body over a pulley.
    """
    from cdpr_drake.geometry.cable_routes import WORLD_BODY  # which single platforms do not need

    check_model(model, routes.ends)
    if routes.ends.beyond.size:
        raise CableModelError(
            "cable.behaviour: found cables between bodies that stiffen, are warm, creep or rub; "
            "accepted there: elastic and damped ones"
        )
    if not CABLE_MODELS[model].sags:
        return
    for i, name in enumerate(routes.names):
        if not routes.ends.linear_weight[i] > 0.0:
            continue
        points = routes.first[i + 1] - routes.first[i]
        if points > 2:
            raise CableModelError(
                f"{name}: found {points - 2} eyelets on a cable with weight; accepted for the "
                "catenary: none, or a cable with linear_weight 0"
            )
        if routes.bodies[routes.first[i]] != WORLD_BODY and routes.ends.pulley_radius[i] > 0.0:
            raise CableModelError(
                f"pulley_radius of {name}: found {routes.ends.pulley_radius[i]:g} at an exit point "
                "on a moving body; accepted for the catenary: 0 [m], or an exit point in the "
                "world, since the plane of a cable that sags is vertical and a swivel axis that "
                "tilts is not"
            )
