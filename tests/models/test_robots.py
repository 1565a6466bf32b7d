"""The robots that come with the package: each loads and hangs still; published values."""

import re
from importlib.resources import files

import numpy as np
import pytest
import yaml
from pydrake.math import RigidTransform
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.geometry.straight_cables import gravity_wrench, wrench_matrix
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.camera_files import camera_names
from cdpr_drake.models.mechanism_files import mechanism_names
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot, robot_names
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step
from tests.models.published_points import LARGE_ANCHORS
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS

STILL = 1e-6
"""A robot in equilibrium moves by round-off only; this is a micrometre and a microradian."""

TENSION_ROUND_OFF = 1e-6
"""Tensions [N] may leave their bounds by the round-off of lengths times the cables' stiffness."""

ROBOTS = files("cdpr_drake.models").joinpath("robots")

PRINTED_DIGITS = 0.005
"""Half of the last digit of the tensions in servoing thesis, section 1.3.4 [N]."""

ACROBOT_UPPER_EXITS = [
    (-0.47, -0.525, 1.165),
    (-0.52, -0.465, 1.165),
    (-0.52, 0.475, 1.165),  # printed with y = -0.475, a sign error
    (-0.47, 0.53, 1.165),
    (0.47, 0.53, 1.165),
    (0.52, 0.475, 1.165),
    (0.525, -0.47, 1.165),
    (0.47, -0.52, 1.165),
]
"""Servoing thesis, table A.1."""

FULLY_CONSTRAINED_EXITS = [
    (0.52, 0.475, 0.0),
    (-0.47, 0.53, 1.165),
    (-0.52, 0.475, 0.0),
    (0.47, 0.53, 1.165),
    (-0.52, -0.465, 0.0),
    (0.47, -0.52, 1.165),
    (0.525, -0.47, 0.0),
    (-0.47, -0.525, 1.165),
]
"""Servoing thesis, table 3.1."""

SMALL_ANCHORS = [
    (0.055, -0.055, 0.07),
    (-0.055, 0.055, 0.025),
    (-0.055, -0.055, 0.07),
    (0.055, 0.055, 0.025),
    (-0.055, 0.055, 0.07),
    (0.055, -0.055, 0.025),
    (0.055, 0.055, 0.07),
    (-0.055, -0.055, 0.025),
]
"""Servoing thesis, table A.1."""

CAROCA_EXITS = [
    (1.659, -2.850, 3.221),
    (1.350, -3.159, 3.221),
    (-1.350, -3.159, 3.221),
    (-1.659, -2.850, 3.221),
    (-1.659, 2.850, 3.221),
    (-1.350, 3.159, 3.221),
    (1.350, 3.159, 3.221),
    (1.659, 2.850, 3.221),
]
"""Servoing thesis, table A.7."""

CAROCA_ANCHORS = [
    (0.21, 0.13, 0.23),
    (-0.14, -0.16, 0.02),
    (0.14, -0.16, 0.23),
    (-0.21, 0.13, 0.02),
    (-0.21, -0.13, 0.23),
    (0.14, 0.16, 0.02),
    (-0.14, 0.16, 0.23),
    (0.21, -0.13, 0.02),
]
"""Servoing thesis, table A.7."""

GAZEBO_ANCHORS = [
    (0.6, -0.3, -0.2),
    (-0.6, 0.3, 0.2),
    (-0.6, -0.3, 0.2),
    (0.6, 0.3, -0.2),
    (-0.6, -0.3, -0.2),
    (0.6, 0.3, 0.2),
    (0.6, -0.3, 0.2),
    (-0.6, 0.3, -0.2),
]
"""Gazebo thesis, robot file of its simulator; from the middle of the platform."""

ACROBOTS = ("acrobot_small", "acrobot_large", "acrobot_fully_constrained")


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_every_robot_loads_and_hangs_still_at_home(name):
    robot = load_robot(name)
    block = CableRobot(robot)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    home = robot.home.transform()
    block.set_at_equilibrium(context, home)
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(len(robot.cables)))
    ResetIntegratorFromFlags(simulator, "runge_kutta3", automatic_step(robot, home, "runge_kutta3"))
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    for time in np.linspace(0.02, 0.2, 10):
        simulator.AdvanceTo(time)
        distance, angle = pose_error(home, block.GetOutputPort("X_WP").Eval(context))
        assert distance < STILL
        assert angle < STILL
        tensions = block.GetOutputPort("tensions").Eval(context)
        assert np.all(tensions >= robot.tension_bounds.lower - TENSION_ROUND_OFF)
        assert np.all(tensions <= robot.tension_bounds.upper + TENSION_ROUND_OFF)


def test_every_folder_has_a_readme_and_a_robot_of_its_name():
    folders = [entry for entry in ROBOTS.iterdir() if entry.is_dir()]
    assert {folder.name for folder in folders} == {*robot_names(), *mechanism_names()}
    for folder in folders:
        assert folder.joinpath("README.md").read_text(encoding="utf-8").startswith("# ")
        file = "mechanism.yaml" if folder.name in mechanism_names() else "robot.yaml"
        content = yaml.safe_load(folder.joinpath(file).read_text(encoding="utf-8"))
        assert content["name"] == folder.name


@pytest.mark.parametrize(
    ("name", "exit_points", "anchor_points"),
    [
        ("acrobot_small", ACROBOT_UPPER_EXITS, SMALL_ANCHORS),
        ("acrobot_large", ACROBOT_UPPER_EXITS, LARGE_ANCHORS),
        ("acrobot_fully_constrained", FULLY_CONSTRAINED_EXITS, LARGE_ANCHORS),
        ("caroca", CAROCA_EXITS, CAROCA_ANCHORS),
    ],
)
def test_points_are_the_published_ones(name, exit_points, anchor_points):
    robot = load_robot(name)
    np.testing.assert_array_equal(robot.exit_points(), np.transpose(exit_points))
    np.testing.assert_array_equal(robot.anchor_points(), np.transpose(anchor_points))


@pytest.mark.parametrize(
    ("name", "mass", "size", "modulus", "diameter", "drum", "gear", "speed"),
    [
        ("acrobot_small", 1.5, (0.11, 0.11, 0.07), 111e9, 2e-3, 0.04, 10.0, 3000.0),
        ("acrobot_large", 3.5, (0.18, 0.17, 0.07), 111e9, 2e-3, 0.04, 10.0, 3000.0),
        ("acrobot_fully_constrained", 3.5, (0.18, 0.17, 0.07), 111e9, 2e-3, 0.04, 10.0, 3000.0),
        ("caroca", 150.0, (0.42, 0.32, 0.23), 102.2e9, 6e-3, 0.06, 40.0, 2200.0),
    ],
)
def test_masses_cables_and_winches_are_the_published_ones(
    name, mass, size, modulus, diameter, drum, gear, speed
):
    """Servoing thesis, appendices A.1.1 and A.1.2."""
    robot = load_robot(name)
    assert robot.platform.mass == mass
    np.testing.assert_array_equal(robot.platform.size, size)
    assert (robot.cable.youngs_modulus, robot.cable.diameter) == (modulus, diameter)
    winch = robot.winch
    assert (winch.drum_radius, winch.gear_ratio, winch.motor_speed_rpm) == (drum, gear, speed)
    assert winch.rated_cable_speed() == pytest.approx(speed * np.pi / 30.0 * drum / gear)
    np.testing.assert_allclose(robot.stiffness(), np.full(8, modulus * np.pi / 4 * diameter**2))


def test_caroca_motors_and_pulleys():
    """Servoing thesis, appendix A.1.2 and figure 1.14 (diameter 150 mm)."""
    robot = load_robot("caroca")
    assert robot.winch.motor_torque == 15.34
    assert robot.pulley.radius == 0.075
    # The upper bound of the tensions is what the motors can hold, rounded down.
    assert robot.tension_bounds.upper <= 15.34 * 40.0 / 0.06


def test_sources_are_named_where_the_numbers_stand():
    """Points of caroca_gazebo are those of a public file; tensions are met as far as they are."""
    words = ROBOTS.joinpath("caroca_gazebo/README.md").read_text(encoding="utf-8")
    (row,) = (line for line in words.splitlines() if line.startswith("| exit and anchor points"))
    assert "github.com/oKermorgant/cdpr" in row
    assert "sdf/caroca.yaml" in row
    assert "thesis" not in row
    for name in ("acrobot_small", "acrobot_large"):
        words = ROBOTS.joinpath(f"{name}/README.md").read_text(encoding="utf-8")
        assert re.search(r"0\.15\) to\s0\.02 N", words)


def test_caroca_of_the_gazebo_thesis():
    """Its simulator's public file, sdf/caroca.yaml of github.com/oKermorgant/cdpr, and the thesis'
    figures 6.8 to 6.20; P lies half a platform below the middle."""
    robot = load_robot("caroca_gazebo")
    middle = np.array([0.0, 0.0, 0.2])
    np.testing.assert_allclose(robot.anchor_points().T, np.array(GAZEBO_ANCHORS) + middle)
    exit_points = robot.exit_points()
    np.testing.assert_array_equal(np.abs(exit_points), np.tile([[3.5], [2.0], [3.5]], 8))
    assert np.all(exit_points[2] > 0.0)
    assert robot.platform.mass == 1.0
    np.testing.assert_array_equal(robot.platform.size, [1.2, 0.6, 0.4])
    np.testing.assert_allclose(robot.center_of_mass(), middle)
    assert (robot.tension_bounds.lower, robot.tension_bounds.upper) == (1.0, 6500.0)
    # The file's inertia for 150 kg is that of a solid box, which ours is too.
    inertia = platform_inertia(robot).Shift(middle).CalcRotationalInertia()
    np.testing.assert_allclose(150.0 * inertia.get_moments(), [6.5, 20.0, 22.5])


@pytest.mark.parametrize("name", ACROBOTS)
def test_acrobot_stands_in_a_cube_of_1_2_m(name):
    """Servoing thesis, appendix A.1.1; the base frame lies in the middle of the floor."""
    robot = load_robot(name)
    np.testing.assert_allclose(robot.frame.upper - robot.frame.lower, np.full(3, 1.2))
    np.testing.assert_allclose(robot.frame.upper[:2], -robot.frame.lower[:2])
    assert robot.frame.lower[2] == 0.0


def test_caroca_stands_in_a_frame_of_4_by_7_m():
    """Servoing thesis, appendix A.1.2."""
    frame = load_robot("caroca").frame
    np.testing.assert_allclose((frame.upper - frame.lower)[:2], [4.0, 7.0])


def test_printed_tensions_hold_the_large_platform():
    """Servoing thesis, section 1.3.4: the tensions at (0.35, -0.27, 0.45) m balance 3.5 kg."""
    robot = load_robot("acrobot_large")
    X_WP = RigidTransform([0.35, -0.27, 0.45])
    W = wrench_matrix(X_WP, robot.exit_points(), robot.anchor_points())
    printed = np.array([2.08, 2.08, 2.43, 2.58, 3.74, 4.30, 12.76, 13.31])
    weight = gravity_wrench(X_WP, 3.5, robot.center_of_mass(), 9.81)
    residual = W @ printed + weight
    assert np.all(np.abs(residual) <= np.abs(W) @ np.full(8, PRINTED_DIGITS))


def test_planar_robot_has_the_published_sizes():
    """Servoing thesis, sections 1.3.2 and 3.2.1: four cables, 1 m x 1 m, platform of 0.11 m."""
    robot = load_robot("planar")
    assert robot.is_planar()
    assert len(robot.cables) == 4
    exit_points = robot.exit_points()
    np.testing.assert_array_equal(np.ptp(exit_points, axis=1), [1.0, 1.0, 0.0])
    np.testing.assert_array_equal(exit_points[2], np.full(4, robot.plane_height))
    np.testing.assert_array_equal(robot.platform.size[:2], [0.11, 0.11])
    np.testing.assert_allclose(np.abs(robot.anchor_points()[:2]), np.full((2, 4), 0.055))


@pytest.mark.parametrize(
    ("name", "width", "height", "horizontal", "vertical", "rate"),
    [
        ("ids_kowa", 1600, 1200, 79.0, 59.4, 60.0),
        ("astra", 640, 480, 60.0, 49.5, 30.0),
    ],
)
def test_cameras_are_the_published_ones(name, width, height, horizontal, vertical, rate):
    """Servoing thesis, tables A.3 to A.5."""
    camera = load_camera(name)
    assert (camera.width, camera.height, camera.rate_hz) == (width, height, rate)
    assert camera.view_angle_horizontal_deg == horizontal
    assert camera.view_angle_vertical_deg == vertical


def test_webcam_has_the_published_image_size():
    """Servoing thesis, table A.2, which gives no view angle."""
    camera = load_camera("mt4018")
    assert (camera.width, camera.height) == (1280, 1024)
    # 4.02 mm focal length and pixels of one size: both angles follow from the same pixel size.
    pinhole = camera.pinhole(1280, 1024)
    assert pinhole.fx == pytest.approx(pinhole.fy, rel=0.01)


@pytest.mark.parametrize("name", ACROBOTS)
def test_camera_of_acrobot_looks_down_where_published(name):
    """Servoing thesis, appendix A.6.1: X_PC turns by Rz(180 deg) Rx(180 deg)."""
    X_PC = load_robot(name).camera_mount("onboard").pose.transform()
    np.testing.assert_array_equal(X_PC.translation(), [-0.0631, 0.0, 0.01])
    np.testing.assert_allclose(X_PC.rotation().matrix(), np.diag([-1.0, 1.0, -1.0]), atol=1e-15)


def test_every_mounted_camera_is_in_the_catalogue():
    for name in robot_names():
        for mount in load_robot(name).cameras:
            assert mount.model in camera_names()
