"""Input that makes no sense is refused in one line that names it."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.errors import (
    CableGeometryError,
    CableModelError,
    EquilibriumError,
    ForwardKinematicsError,
)
from cdpr_drake.geometry.poses import pose_from_angles, pose_row
from cdpr_drake.statics.equilibrium import equilibria, equilibrium_near
from cdpr_drake.statics.equilibrium_enumeration import enumerate_equilibria
from cdpr_drake.statics.equilibrium_program import make_equilibrium_program
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.statics.rigid_platform import RigidPlatform
from cdpr_drake.statics.sensitivity import pose_sensitivity
from cdpr_drake.statics.stiffness import platform_stiffness
from tests.statics.statics_cases import cables_at, hanging, scene

CASE = scene("acrobot_large")
CABLES, PLATFORM, L0, X = CASE.cables, CASE.platform, CASE.lengths, CASE.X_WP
FK = ForwardKinematics(CABLES)
LENGTHS = FK.lengths(X)
NAN = np.full(8, np.nan)
NOTHING = RigidPlatform(1.0, np.zeros(3), np.eye(3), gravity=0.0)
BALL = RigidPlatform(2.0, np.zeros(3), np.eye(3))
ONE_CABLE = cables_at([[0.0, 0.0, 2.0]], [[0.0, 0.0, 0.0]])
THROWN = replace(CABLES, p_PB=np.zeros((3, 8)), p_WA=np.zeros((3, 8)))
ON_EXIT = RigidTransform(CABLES.p_WA[:, 2] - CABLES.p_PB[:, 2])
THREE = [(1.0, 0.0, 2.0), (-0.5, 0.8, 2.0), (-0.5, -0.8, 2.0)]
LEVEL = {"num_turns": 1, "num_moves": 2, "axis": (0.0, 0.0, 1.0)}


def rest(l0=L0, model="elastic", cables=CABLES, X=X):
    return equilibrium_near(cables, model, PLATFORM, l0, X)


def stiffness(l0=L0, model="elastic", X=X):
    return platform_stiffness(CABLES, model, PLATFORM, X, l0)


def on_three(lengths, **change):
    platform = replace(hanging(THREE, 0.1 * np.array(THREE), (0, 0, 0)), **change)
    return enumerate_equilibria(platform, np.array(lengths))


def on_a_ball():
    """All anchor points are one: nothing tells how it is turned."""
    fk = ForwardKinematics(replace(CABLES, p_PB=np.zeros((3, 8))))
    guess = pose_from_angles([0.11, 0.0, 0.3], [0.1, 0.0, 0.0])
    return fk.pose(fk.lengths(RigidTransform([0.1, 0.0, 0.3])), guess)


REFUSALS = {
    # Poses of rest.
    "few lengths": (lambda: rest(L0[:5]), EquilibriumError, "8 finite numbers > 0"),
    "model": (lambda: rest(model="rubber"), CableModelError, "cable model"),
    "no starts": (
        lambda: equilibria(CABLES, "elastic", PLATFORM, L0, []), EquilibriumError, "at least one",
    ),
    "nothing rests": (
        lambda: rest(np.ones(8), "inextensible", THROWN, RigidTransform()),
        EquilibriumError, "none found",
    ),
    "no weight": (
        lambda: make_equilibrium_program(CABLES, "elastic", NOTHING, np.ones(8), RigidTransform()),
        EquilibriumError, "no weight",
    ),
    # All of them.
    "too short": (lambda: on_three([0.3, 0.3, 0.3]), EquilibriumError, "together are"),
    "NaN of three": (lambda: on_three([1.0, np.nan, 1.0]), EquilibriumError, "NaN"),
    "two of three": (lambda: on_three([1.0, 1.0]), EquilibriumError, "2 numbers"),
    "weightless": (
        lambda: on_three([1.5] * 3, weight_W=np.zeros(3)), EquilibriumError, "no weight",
    ),
    "no weight in a level plane": (
        lambda: on_three([1.5] * 3, **LEVEL), EquilibriumError, "no weight",
    ),
    # Stiffness and sensitivity.
    **{
        f"stiffness of {name}": (
            lambda bad=bad: stiffness(bad), CableModelError, "unstrained lengths: found",
        )
        for name, bad in {
            "five": L0[:5], "negative": -L0, "NaN": NAN, "infinity": np.append(L0[:7], np.inf),
        }.items()
    },
    "on its exit point": (
        lambda: stiffness(X=ON_EXIT), CableGeometryError, "cable 3: its anchor point",
    ),
    "stiffness of rigid": (lambda: stiffness(model="inextensible"), CableModelError, "inextens"),
    "sensitivity of rigid": (
        lambda: pose_sensitivity(CABLES, "inextensible", PLATFORM, X, L0),
        CableModelError, "inextensible",
    ),
    "sensitivity of what is free": (
        lambda: pose_sensitivity(ONE_CABLE, "elastic", BALL, RigidTransform(), np.array([1.99])),
        EquilibriumError, "nothing holds",
    ),
    # Poses from lengths.
    **{
        f"pose of {name}": (lambda bad=bad: FK.pose(bad, X), ForwardKinematicsError, words)
        for name, (bad, words) in {
            "five": (LENGTHS[:5], "found shape"), "NaN": (NAN, "NaN"),
            "negative": (-LENGTHS, "> 0"),
            "zero": (np.append(LENGTHS[:7], 0.0), "> 0"),
            "infinity": (np.append(LENGTHS[:7], np.inf), "> 0"),
        }.items()
    },
    **{
        f"pose by {name}": (
            lambda used=used: FK.pose(LENGTHS, X, used), ForwardKinematicsError, words,
        )
        for name, (used, words) in {
            "five": (np.arange(5), "at least 6"),
            "a ninth": (np.arange(3, 9), "accepted: indices 0 to 7"),
            "the last": (np.arange(-1, 6), "found index -1"),
            "a table": (np.zeros((6, 2)), "found 2 axes"),
        }.items()
    },
    "guesses": (
        lambda: FK.poses(LENGTHS[None], np.zeros((1, 6))), ForwardKinematicsError, "guesses",
    ),
    "used of many": (
        lambda: FK.poses(LENGTHS[None], pose_row(X)[None], np.arange(8)),
        ForwardKinematicsError, "used",
    ),
    "a free turn": (on_a_ball, ForwardKinematicsError, "did not settle|do not determine"),
}  # fmt: skip


@pytest.mark.parametrize(("call", "error", "words"), REFUSALS.values(), ids=REFUSALS.keys())
def test_refusal(call, error, words):
    with pytest.raises(error, match=words) as caught:
        call()
    assert len(str(caught.value).splitlines()) == 1
