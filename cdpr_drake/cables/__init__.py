"""What a cable does when it is pulled: models by name, and the kernels behind them.

`CABLE_MODELS` is the table of models: straight or hanging, elastic or not, damped or not. A cable
only pulls; it is slack where it pulls nothing or, with weight, with no more than its own. Pull on
the platform, tension at the anchor and at the exit point, length, sag and their derivatives come
from one function, `cable_state`.

Source: servoing thesis (2.6); Irvine, Cable Structures, 1981, for sagging cables.
"""

from cdpr_drake.cables.commanded_tension_kernel import cable_motions, tension_force
from cdpr_drake.cables.curves import cable_curves
from cdpr_drake.cables.dispatch_kernel import (
    HANGING,
    SLACK_WEIGHTS,
    STRAIGHT,
    all_responses,
    cable_energy,
    cable_response,
)
from cdpr_drake.cables.elastic_law import (
    axial_stiffness,
    cable_stiffness_matrix,
    stretched_lengths,
    unstrained_lengths,
)
from cdpr_drake.cables.hanging_kernel import SENSITIVITIES
from cdpr_drake.cables.models import (
    CABLE_MODELS,
    CATENARY,
    ELASTIC,
    INEXTENSIBLE,
    KELVIN_VOIGT,
    TOO_SHORT,
    CableModel,
    CableState,
    cable_derivatives,
    cable_state,
    check_breaking,
    check_lengths,
    check_model,
    slack_tensions,
)
from cdpr_drake.cables.response_kernel import DERIVATIVES
from cdpr_drake.cables.simulation_autodiff import (
    model_force_and_drums_array,
    model_force_array,
    model_outputs_array,
)
from cdpr_drake.cables.simulation_kernel import (
    OUTPUTS,
    make_room,
    model_force,
    model_force_and_drums,
    model_outputs,
    outputs_kernel,
    straight_outputs,
)
from cdpr_drake.cables.straight_kernel import floating_force, line_force, planar_force

__all__ = [
    "CABLE_MODELS", "CATENARY", "DERIVATIVES", "ELASTIC", "HANGING", "INEXTENSIBLE", "KELVIN_VOIGT",
    "OUTPUTS", "SENSITIVITIES", "SLACK_WEIGHTS", "STRAIGHT", "TOO_SHORT", "CableModel",
    "CableState", "all_responses", "axial_stiffness", "cable_curves", "cable_derivatives",
    "cable_energy", "cable_motions", "cable_response", "cable_state", "cable_stiffness_matrix",
    "check_breaking", "check_lengths", "check_model", "floating_force", "line_force", "make_room",
    "model_force", "model_force_and_drums", "model_force_and_drums_array", "model_force_array",
    "model_outputs", "model_outputs_array", "outputs_kernel", "planar_force", "slack_tensions",
    "straight_outputs", "stretched_lengths", "tension_force", "unstrained_lengths",
]  # fmt: skip
