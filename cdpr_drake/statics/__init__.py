"""The platform at rest: tensions that hold it, where it hangs, how stiff it is, what moves it.

Stiffness matrices map a small twist (rotation, translation) about Po in W to the wrench that
resists it. A pose of rest is a minimum of the potential energy of cables and weight; its verdict
is judged by the Hessian.

Source: servoing thesis 1.2.4 and 2.2; Pott, 2018.
"""

from cdpr_drake.kinematics import ForwardKinematics
from cdpr_drake.statics.controlled_wrenches import WrenchControl, combination_words, wrench_control
from cdpr_drake.statics.equilibrium import (
    Equilibrium,
    Stability,
    anchor_arm,
    equilibria,
    equilibrium_near,
    judge_equilibrium,
    principal_stiffnesses,
    random_starts,
)
from cdpr_drake.statics.equilibrium_program import (
    make_equilibrium_program,
    solve_equilibrium_program,
)
from cdpr_drake.statics.inextensible_equilibrium import tension_stiffness
from cdpr_drake.statics.rest_tensions import LEAST_TENSION_WEIGHTS, Holding, hold
from cdpr_drake.statics.rigid_platform import RigidPlatform
from cdpr_drake.statics.sensitivity import pose_sensitivity
from cdpr_drake.statics.stiffness import (
    NaturalModes,
    PlatformStiffness,
    inextensible_modes,
    natural_modes,
    platform_stiffness,
)

__all__ = [
    "LEAST_TENSION_WEIGHTS", "Equilibrium", "ForwardKinematics", "Holding", "NaturalModes",
    "PlatformStiffness", "RigidPlatform", "Stability", "WrenchControl", "anchor_arm",
    "combination_words", "equilibria", "equilibrium_near", "hold", "inextensible_modes",
    "judge_equilibrium", "make_equilibrium_program", "natural_modes", "platform_stiffness",
    "pose_sensitivity", "principal_stiffnesses", "random_starts", "solve_equilibrium_program",
    "tension_stiffness", "wrench_control",
]  # fmt: skip
