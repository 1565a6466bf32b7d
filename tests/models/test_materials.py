"""Cables of several materials in one robot: stiffness, weight, damping, breaking, drums, files."""

from __future__ import annotations

import numpy as np
import pytest

from cdpr_drake.cables.elastic_law import axial_stiffness
from cdpr_drake.cables.models import check_breaking
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.models.ups_robot import rod_masses
from cdpr_drake.statics.stiffness import platform_stiffness
from cdpr_drake.winches.motor import MODES, winch_motion
from cdpr_drake.winches.motor_kernel import pack_winch, winch_rates
from tests.models.robots import content_of, robot_of

OWN = {
    "diameter": 0.004,
    "youngs_modulus": 2.5e9,
    "linear_density": 0.03,
    "retardation_time": 2e-3,
    "breaking_load": 90.0,
}

SAME = 1e-12
"""The kernel and the array path round alike, up to the order of two products."""


def mixed(own=OWN, cables=(2, 5)):
    content = content_of()
    for k in cables:
        content["cables"][k]["material"] = own
    return robot_of(content)


def test_a_cable_has_its_own_values_and_the_others_the_common_ones():
    robot, common = mixed(), load_robot("acrobot_small")
    cables, before = robot.cable_set(), common.cable_set()
    others = [0, 1, 3, 4, 6, 7]
    for name in ("stiffness", "retardation", "linear_weight", "breaking_load"):
        np.testing.assert_array_equal(getattr(cables, name)[others], getattr(before, name)[others])
    for k in (2, 5):
        assert cables.stiffness[k] == axial_stiffness(2.5e9, 0.004)
        assert cables.linear_weight[k] == 0.03 * robot.gravity
        assert cables.retardation[k] == 2e-3
        assert cables.breaking_load[k] == 90.0
    assert robot.knows_breaking_loads()
    assert not common.knows_breaking_loads()
    assert rod_masses(robot)[2] / rod_masses(common)[2] == pytest.approx(
        0.03 / common.cable.linear_density
    )


def test_one_key_alone_leaves_the_others_as_they_are():
    robot, common = mixed({"diameter": 0.004}), load_robot("acrobot_small").cable_set()
    ratio = (0.004 / robot.cable.diameter) ** 2
    assert robot.cable_set().stiffness[2] == pytest.approx(ratio * common.stiffness[2])
    assert robot.cable_set().linear_weight[2] == common.linear_weight[2]


def test_the_platform_stiffness_is_that_of_these_springs():
    robot = mixed({"youngs_modulus": 2.5e9})
    cables, X_WP = robot.cable_set().without_pulleys(), robot.home.transform()
    paths = cable_paths(X_WP, cables)
    strain = 1e-4
    l0 = paths.lengths / (1.0 + strain)
    found = platform_stiffness(cables, "elastic", rigid_platform(robot), X_WP, l0)
    springs = paths.J.T @ np.diag(cables.stiffness / l0) @ paths.J
    np.testing.assert_allclose(found.elastic, springs, rtol=1e-12, atol=1e-9 * np.max(springs))


def test_the_weaker_cable_breaks():
    cables = mixed().cable_set()
    l0 = np.ones(8)
    check_breaking(cables, np.full(8, 89.0), l0)
    with pytest.raises(CableGeometryError, match=r"cable 3: .*breaking load, 90 N"):
        check_breaking(cables, np.full(8, 91.0), l0)


def test_a_thicker_cable_lies_farther_out_on_its_drum():
    robot, common = mixed({"diameter": 0.01}), load_robot("acrobot_small")
    radii, before = robot.drum().radii(8), common.drum().radii(8)
    more = (0.01 - common.cable.diameter) / 2.0 / common.winch.gear_ratio
    np.testing.assert_allclose(radii - before, more * np.isin(np.arange(8), (2, 5)), atol=1e-18)
    angles = np.linspace(-3.0, 3.0, 8)
    np.testing.assert_allclose(robot.drum().paid_out(angles), radii * angles, rtol=1e-12)
    np.testing.assert_allclose(robot.drum().motor_angles(radii * angles), angles, rtol=1e-12)


@pytest.mark.parametrize("layers", [None, {"turns": 3.0, "wound": 1.5}])
def test_motors_with_several_diameters_move_as_single_ones(layers):
    content = content_of()
    content["winch"]["layers"] = layers
    alone = []
    for diameter in (None, 0.01):
        if diameter:
            content["cable"]["diameter"] = diameter
        alone.append(robot_of(content).winch_law())
    content = content_of()
    content["winch"]["layers"] = layers
    content["cables"][5]["material"] = {"diameter": 0.01}
    law = robot_of(content).winch_law()
    home = np.full(8, 2.0)
    state = np.concatenate([home + np.linspace(-0.4, 0.4, 8), np.linspace(-0.2, 0.3, 8)])
    tensions, command, free = np.linspace(5.0, 40.0, 8), np.linspace(-0.3, 0.2, 8), np.zeros(8)

    def rates(one):
        out = np.empty(16)
        winch_rates(state, tensions, command, free, home, MODES["torque"], pack_winch(one), out)
        return out

    thin, thick = map(rates, alone)
    for found in (rates(law), arrays_of(law, state, tensions, command, home)):
        np.testing.assert_allclose(np.delete(found[8:], 5), np.delete(thin[8:], 5), rtol=SAME)
        assert found[13] == pytest.approx(thick[13], rel=SAME)


def arrays_of(law, state, tensions, command, home):
    """The same by the array path."""
    parts = (state[:8], state[8:], np.zeros(8))
    motion = winch_motion(law, MODES["torque"], parts, tensions, command, np.zeros(8), home=home)
    return np.concatenate([state[8:], motion.length_acceleration])
