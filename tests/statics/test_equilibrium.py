"""Poses of rest against closed forms, time-domain simulation and a mathematical program."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from cdpr_drake.cables.elastic_law import unstrained_lengths
from cdpr_drake.cables.models import CABLE_MODELS, cable_state
from cdpr_drake.errors import CableModelError, EquilibriumError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics import equilibrium
from cdpr_drake.statics.equilibrium import (
    Equilibrium,
    Stability,
    equilibria,
    equilibrium_near,
    random_starts,
)
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.statics.rigid_platform import RigidPlatform
from cdpr_drake.systems.robots.cable_robot import CableRobot, holding_tensions

SETTLED = 1e-8
"""Closed forms: the search stops at forces of 1e-10 of the weight, on E S / l of 1e5 N/m."""

MASS, GRAVITY, ES, HEAVY = 2.0, 9.81, 1e5, 0.3
WEIGHT = MASS * GRAVITY
PLATFORM = RigidPlatform(
    MASS, np.array([0.0, 0.0, -0.2]), np.diag([0.1, 0.1, 0.05]) + 0.08 * np.diag([1.0, 1.0, 0.0])
)
POINT = RigidPlatform(MASS, np.zeros(3), np.diag([0.02, 0.02, 0.02]))


def cables_at(exits, anchors, weight=0.0):
    return CableSet.make(
        np.array(exits, float).T, np.array(anchors, float).T, ES, linear_weight=weight
    )


@pytest.mark.parametrize("model", sorted(CABLE_MODELS))
def test_one_cable_is_a_pendulum(model):
    w = HEAVY if model == "catenary" else 0.0
    cables = cables_at([[0.3, -0.2, 2.0]], [[0.0, 0.0, 0.1]], w)
    guess = pose_from_angles([0.5, 0.0, 1.0], [0.2, -0.3, 0.4])
    rest = equilibrium_near(cables, model, PLATFORM, np.array([1.2]), guess)
    stretch = 0.0 if model == "inextensible" else (WEIGHT * 1.2 + 0.5 * w * 1.2**2) / ES
    B = rest.X_WP.multiply(np.array([0.0, 0.0, 0.1]))
    np.testing.assert_allclose(B, [0.3, -0.2, 2.0 - 1.2 - stretch], atol=1e-6)
    np.testing.assert_allclose(rest.X_WP.translation()[:2], [0.3, -0.2], atol=1e-6)
    np.testing.assert_allclose(rest.tensions, WEIGHT, rtol=1e-8)
    assert rest.stability == Stability.NEUTRAL  # it may spin about the cable
    # The pendulum's own stiffness: mg / length for the anchor, mg * arm for the turn.
    assert rest.stiffnesses[1] > 0.0


@pytest.mark.parametrize("model", ["inextensible", "elastic"])
@pytest.mark.parametrize("l0", [(1.3, 1.5), (1.0, 2.4)])
def test_two_cables_on_one_point(model, l0):
    """A triangle, or a pendulum on the shorter cable; with the tensions of the sine law."""
    exits = [[-1.0, 0.0, 2.0], [1.0, 0.0, 2.0]]
    cables = cables_at(exits, [[0.0, 0.0, 0.0]] * 2)
    rest = equilibrium_near(cables, model, POINT, np.array(l0), RigidTransform([-0.9, 0.2, 1.3]))
    a, b = np.array(l0) * (1.0 if model == "inextensible" else 1.0 + rest.tensions / ES)
    if l0[1] > 2.0:
        expected, tensions = [-1.0, 0.0, 2.0 - a], [WEIGHT, 0.0]
    else:
        x = (a * a - b * b) / 4.0
        z = np.sqrt(a * a - (1.0 + x) ** 2)
        expected = [x, 0.0, 2.0 - z]
        tensions = [WEIGHT * a * (1.0 - x) / (2.0 * z), WEIGHT * b * (1.0 + x) / (2.0 * z)]
    np.testing.assert_allclose(rest.X_WP.translation(), expected, atol=SETTLED)
    np.testing.assert_allclose(rest.tensions, tensions, rtol=1e-6, atol=1e-12)
    np.testing.assert_array_equal(rest.slack, np.array(tensions) == 0.0)


def of_robot(name, pulleys=False, at=(0.1, 0.05, 0.1), turn=(0.0, 0.0, 0.05)):
    robot = load_robot(name)
    X = pose_from_angles(robot.home.transform().translation() + np.array(at), turn)
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    l0 = unstrained_lengths(
        ForwardKinematics(cables, robot.motion_type()).lengths(X),
        holding_tensions(robot, X, cables.without_pulleys()),
        cables.stiffness,
    )
    return robot, cables, rigid_platform(robot), l0, X


@pytest.mark.parametrize("name", ["acrobot_large", "acrobot_fully_constrained", "caroca", "planar"])
def test_unstrained_lengths_that_hold_a_pose_lead_back_to_it(name):
    at = (0.1, 0.05, 0.0) if name == "planar" else (0.1, 0.05, 0.1)
    robot, cables, platform, l0, X = of_robot(name, at=at)
    guess = RigidTransform(X.rotation(), X.translation() + np.array([0.01, -0.01, 0.0]))
    rest = equilibrium_near(cables, "elastic", platform, l0, guess)
    assert pose_error(rest.X_WP, X) < (SETTLED, SETTLED)
    np.testing.assert_allclose(rest.tensions, holding_tensions(robot, X, cables), atol=1e-3)
    assert rest.stability == Stability.STABLE
    assert len(rest.stiffnesses) == (3 if name == "planar" else 6)


@pytest.mark.parametrize("model", ["elastic", "catenary"])
def test_forces_balance_over_pulleys(model):
    _, cables, platform, l0, X = of_robot("caroca", pulleys=True)
    rest = equilibrium_near(cables, model, platform, l0, X)
    wrench = cable_state(cables, model, rest.X_WP, l0).wrench + platform.weight_wrench(rest.X_WP)
    np.testing.assert_allclose(wrench, 0.0, atol=1e-5)  # of 1500 N
    distance, _ = pose_error(rest.X_WP, X)
    # The winches measured these lengths without pulley and sag; each moves CAROCA by millimetres.
    assert distance < (2e-2 if model == "catenary" else 1e-2)


def test_the_simulation_settles_there():
    robot, cables, platform, l0, X = of_robot("acrobot_large")
    l0 = l0 + np.array([0.003, -0.002, 0.0, 0.004, -0.003, 0.002, 0.0, -0.001])
    rest = equilibrium_near(cables, "elastic", platform, l0, X)
    damped = replace(robot, cable=replace(robot.cable, retardation_time=2e-3))
    diagram = CableRobot(damped)
    context = diagram.CreateDefaultContext()
    diagram.set_at_equilibrium(context, rest.X_WP)
    diagram.winches.set_unstrained_lengths(
        diagram.GetMutableSubsystemContext(diagram.winches, context), l0
    )
    start = RigidTransform(
        rest.X_WP.rotation(), rest.X_WP.translation() + np.array([2e-3, 0.0, 1e-3])
    )
    plant = diagram.GetMutableSubsystemContext(diagram.plant, context)
    diagram.in_plant.set_pose(plant, start)
    diagram.GetInputPort("cable_velocities").FixValue(context, np.zeros(8))
    simulator = Simulator(diagram, context)
    simulator.AdvanceTo(4.0)
    distance, angle = pose_error(diagram.in_plant.pose(plant), rest.X_WP)
    # What is left of the start after four seconds of the slowest mode.
    assert distance < 1e-6
    assert angle < 1e-5
    np.testing.assert_allclose(
        diagram.GetOutputPort("tensions").Eval(context), rest.tensions, atol=1e-2
    )
    assert 0 < np.sum(rest.tensions == 0.0) <= 2


def test_inextensible_cables_keep_six_taut():
    _, cables, platform, l0, X = of_robot("acrobot_large")
    l0 = l0 + 1e-3 * np.random.default_rng(3).normal(size=8)
    rigid = equilibrium_near(cables, "inextensible", platform, l0, X)
    assert np.sum(rigid.tensions > 0.0) == 6
    lengths = ForwardKinematics(cables).lengths(rigid.X_WP)
    np.testing.assert_allclose(lengths[rigid.tensions > 0.0], l0[rigid.tensions > 0.0], atol=1e-9)
    assert np.all(lengths <= l0 + 1e-9)
    assert np.all(np.isinf(rigid.stiffnesses))
    stiff = replace(cables, stiffness=100.0 * cables.stiffness)
    elastic = equilibrium_near(stiff, "elastic", platform, l0, X)
    distance, _ = pose_error(rigid.X_WP, elastic.X_WP)
    assert distance < 1e-5  # stretches of 1e-6 m
    np.testing.assert_allclose(rigid.tensions, elastic.tensions, atol=0.05)


@pytest.mark.parametrize("model", ["inextensible", "elastic", "catenary"])
def test_four_cables_hang_stably_but_softly(model):
    """Fewer cables than degrees of freedom: the pose follows from equilibrium."""
    exits = [[-1.0, -1.0, 3.0], [1.0, -1.0, 3.0], [1.0, 1.0, 3.0], [-1.0, 1.0, 3.0]]
    anchors = [[-0.2, -0.2, 0.1], [0.2, -0.2, 0.1], [0.2, 0.2, 0.1], [-0.2, 0.2, 0.1]]
    cables = cables_at(exits, anchors, HEAVY)
    guess = pose_from_angles([0.1, 0.1, 1.0], [0.1] * 3)
    rest = equilibrium_near(cables, model, PLATFORM, np.full(4, 2.0), guess)
    np.testing.assert_allclose(rest.X_WP.translation()[:2], 0.0, atol=1e-6)
    assert rest.stability == Stability.STABLE
    if model != "inextensible":  # there two cables suffice, and statics cannot tell which
        np.testing.assert_allclose(rest.tensions, rest.tensions[0], rtol=1e-6)


@pytest.mark.parametrize("name", ["acrobot_large", "planar"])
def test_distinct_equilibria_from_many_starts_lowest_first(name):
    at = (0.1, 0.05, 0.0) if name == "planar" else (0.1, 0.05, 0.1)
    robot, cables, platform, l0, X = of_robot(name, at=at)
    lower = np.append(robot.frame.lower[:2], X.translation()[2])
    starts = random_starts(lower, robot.frame.upper, 60, 0, platform.motion)
    found = equilibria(cables, "elastic", platform, l0, starts)
    assert len(found) > 1  # it hangs upside down or turned half round, too
    assert pose_error(found[0].X_WP, X) < (SETTLED, SETTLED)
    assert [one.energy for one in found] == sorted(one.energy for one in found)
    rows = list(platform.motion.rows)
    for k, one in enumerate(found):
        assert one.stability == Stability.STABLE
        wrench = cable_state(cables, "elastic", one.X_WP, l0).wrench
        wrench = (wrench + platform.weight_wrench(one.X_WP))[rows]
        np.testing.assert_allclose(wrench, 0.0, atol=1e-6)
        assert all(pose_error(one.X_WP, other.X_WP)[1] > 1e-3 for other in found[:k])


def resting(x, energy, stability):
    return Equilibrium(
        X_WP=RigidTransform([x, 0.0, 0.0]), tensions=np.ones(1), slack=np.zeros(1, bool),
        energy=energy, unbalanced=0.0, stiffnesses=np.zeros(6), stability=stability, steps=1,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("energies", "kinds", "distinct"),
    [
        ((5.0, 5.0), "stable stable", 2),
        ((5.0, 5.0), "neutral neutral", 1),
        ((5.0, 5.0), "neutral stable", 1),
        ((5.0, 5.0 + 4e-6), "neutral neutral", 1),
        ((-5.0, -5.0 - 4e-6), "neutral neutral", 1),
        ((5.0, 5.0 + 6e-6), "neutral neutral", 2),
        ((5.0, -5.0), "neutral neutral", 2),
        ((1e-5, 1e-5 + 9e-10), "neutral neutral", 1),
        ((1e-5, 1e-5 + 2e-9), "neutral neutral", 2),
    ],
)
def test_one_of_a_neutral_family_is_kept(monkeypatch, energies, kinds, distinct):
    """Elsewhere, of the same energy to a millionth, at least to 1 nJ, and one of them neutral."""
    found = [
        resting(0.1 * k, energy, Stability(kind))
        for k, (energy, kind) in enumerate(zip(energies, kinds.split(), strict=True))
    ]
    searched = iter(found)
    monkeypatch.setattr(equilibrium, "equilibrium_near", lambda *args, **how: next(searched))
    kept = equilibria(None, "elastic", PLATFORM, None, [one.X_WP for one in found])
    assert len(kept) == distinct


def test_errors_say_what_is_wrong():
    _, cables, platform, l0, X = of_robot("acrobot_large")
    with pytest.raises(EquilibriumError, match="8 finite numbers > 0"):
        equilibrium_near(cables, "elastic", platform, l0[:5], X)
    with pytest.raises(CableModelError, match="cable model"):
        equilibrium_near(cables, "rubber", platform, l0, X)
    with pytest.raises(EquilibriumError, match="at least one"):
        equilibria(cables, "elastic", platform, l0, [])
    thrown = replace(cables, p_PB=np.zeros((3, 8)), p_WA=np.zeros((3, 8)))
    with pytest.raises(EquilibriumError, match="none found"):
        equilibrium_near(
            thrown, "inextensible", platform, np.full(8, 1.0), RigidTransform([0.0, 0.0, 0.0])
        )
