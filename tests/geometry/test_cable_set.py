"""The constants of cables: packing, copies, and refusal of what cannot be."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.errors import CableModelError, RobotFileError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_kernel import pack_cables
from cdpr_drake.models.robot_loader import load_robot
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS

P_WA = np.array([[1.0, -1.0], [0.0, 0.1], [2.0, 2.1]])
P_PB = np.array([[0.1, -0.1], [0.0, 0.0], [0.05, 0.0]])
CABLES = CableSet.make(P_WA, P_PB, 1e5, retardation=1e-4, pulley_radius=np.array([0.0, 0.05]))


def test_packed_rows_hold_one_cable_each():
    expected = [-1.0, 0.1, 2.1, -0.1, 0.0, 0.0, 1e5, 1e-4, 0.05, 0.0, 0.0, 0.0, 1.0]
    expected += [0.0, 0.0, 0.0, 1.0]  # of the platform's end
    np.testing.assert_array_equal(CABLES.packed()[1], expected)
    assert CABLES.packed().flags.c_contiguous
    assert CABLES.count == 2


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_robots_give_their_cables(name):
    robot = load_robot(name)
    cables = robot.cable_set()
    T = np.full(cables.count, robot.cable.retardation_time)
    straight = pack_cables(robot.exit_points(), robot.anchor_points(), robot.stiffness(), T)
    np.testing.assert_array_equal(cables.packed()[:, :8], straight)
    assert np.all(cables.pulley_radius == robot.pulley.radius)
    np.testing.assert_allclose(cables.linear_weight, robot.cable.linear_density * robot.gravity)
    assert cables.has_pulleys() == (robot.pulley.radius > 0.0)
    assert not cables.without_pulleys().has_pulleys()


def test_a_swivel_axis_may_be_given_for_one_cable():
    robot = load_robot("acrobot_small")
    robot.cables[2].swivel_axis = np.array([0.0, 3.0, 4.0])
    axes = robot.cable_set().swivel_axis
    np.testing.assert_allclose(axes[:, 2], [0.0, 0.6, 0.8])
    np.testing.assert_array_equal(axes[:, 1], [0.0, 0.0, 1.0])


def test_it_keeps_its_own_numbers():
    points = P_WA.copy()
    cables = CableSet.make(points, P_PB, 1e5)
    points[0, 0] = 7.0
    assert cables.p_WA[0, 0] == 1.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"p_PB": P_PB[:, :1]}, "p_PB: found shape"),
        ({"stiffness": np.array([1e5, 0.0])}, "stiffness of cable 2: found 0.0; accepted"),
        ({"stiffness": np.array([1e5, np.inf])}, "stiffness of cable 2"),
        ({"retardation": np.array([-1e-4, 0.0])}, "retardation of cable 1"),
        ({"pulley_radius": np.array([0.0, -0.1])}, "pulley_radius of cable 2"),
        ({"linear_weight": np.array([0.0, np.nan])}, "linear_weight of cable 2"),
        ({"breaking_load": np.array([0.0, 1.0])}, "breaking_load of cable 1"),
        ({"swivel_axis": np.ones((3, 2))}, "swivel_axis of cable 1"),
        ({"p_WA": np.full((3, 2), np.nan)}, "p_WA of cable 1"),
    ],
)
def test_what_cannot_be_is_refused(change, message):
    with pytest.raises(CableModelError, match=message):
        replace(CABLES, **change)


def test_no_cables_are_refused():
    with pytest.raises(CableModelError, match="with m >= 1 cables"):
        CableSet.make(np.zeros((3, 0)), np.zeros((3, 0)), 1e5)


def test_a_swivel_axis_of_length_zero_is_refused_in_a_file(tmp_path):
    from cdpr_drake.models.robot_loader import robot_file

    text = robot_file("planar").read_text()
    path = tmp_path / "planar.yaml"
    path.write_text(text.replace("radius: 0.0045", "radius: 0.0045\n  swivel_axis: [0, 0, 0]"))
    with pytest.raises(RobotFileError, match=r"pulley\.swivel_axis: found \(0, 0, 0\)"):
        load_robot(str(path))
