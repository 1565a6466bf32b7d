"""Robots, cameras and sensors of the package: each hangs still, says its sources, is printed."""

import re
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import yaml
from pydrake.math import RigidTransform
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from cdpr_drake.errors import DataFileError, RobotFileError
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.geometry.straight_cables import gravity_wrench, wrench_matrix
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.camera_files import camera_names
from cdpr_drake.models.mechanism_files import mechanism_names
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot, robot_names
from cdpr_drake.models.sensor_catalogue import (
    depth_sensor_names,
    encoder_names,
    inertial_sensor_names,
    load_depth_sensor,
    load_encoder,
    load_inertial_sensor,
    load_pose_sensor,
    load_range_sensor,
    load_tension_sensor,
    pose_sensor_names,
    range_sensor_names,
    tension_sensor_names,
)
from cdpr_drake.schema.typed_yaml import refuse
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step
from tests.models.formats.unusual_robots import made
from tests.models.published_points import LARGE_ANCHORS
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS

STILL = 1e-6
"""A robot in equilibrium moves by round-off only; this is a micrometre and a microradian."""

BOUND_ROUND_OFF = 1e-9
"""Tensions may leave their bounds by the round-off of lengths times stiffness, as a share of it;
for representative robots by 1e-6 N."""

PRINTED_DIGITS = 0.005
"""Half of the last digit of the tensions in servoing thesis, section 1.3.4 [N]."""

ROBOTS = files("cdpr_drake.models").joinpath("robots")
UPPER_EXITS = [
    (-0.47, -0.525, 1.165), (-0.52, -0.465, 1.165), (-0.52, 0.475, 1.165), (-0.47, 0.53, 1.165),
    (0.47, 0.53, 1.165), (0.52, 0.475, 1.165), (0.525, -0.47, 1.165), (0.47, -0.52, 1.165),
]  # fmt: skip
"""Servoing thesis, table A.1, where the third is printed with y = -0.475, a sign error."""

CONSTRAINED_EXITS = [
    (0.52, 0.475, 0.0), (-0.47, 0.53, 1.165), (-0.52, 0.475, 0.0), (0.47, 0.53, 1.165),
    (-0.52, -0.465, 0.0), (0.47, -0.52, 1.165), (0.525, -0.47, 0.0), (-0.47, -0.525, 1.165),
]  # fmt: skip
"""Servoing thesis, table 3.1."""

SMALL_ANCHORS = [
    (0.055, -0.055, 0.07), (-0.055, 0.055, 0.025), (-0.055, -0.055, 0.07), (0.055, 0.055, 0.025),
    (-0.055, 0.055, 0.07), (0.055, -0.055, 0.025), (0.055, 0.055, 0.07), (-0.055, -0.055, 0.025),
]  # fmt: skip
"""Servoing thesis, table A.1."""

CAROCA_EXITS = [
    (1.659, -2.850, 3.221), (1.350, -3.159, 3.221), (-1.350, -3.159, 3.221),
    (-1.659, -2.850, 3.221), (-1.659, 2.850, 3.221), (-1.350, 3.159, 3.221),
    (1.350, 3.159, 3.221), (1.659, 2.850, 3.221),
]  # fmt: skip
CAROCA_ANCHORS = [
    (0.21, 0.13, 0.23), (-0.14, -0.16, 0.02), (0.14, -0.16, 0.23), (-0.21, 0.13, 0.02),
    (-0.21, -0.13, 0.23), (0.14, 0.16, 0.02), (-0.14, 0.16, 0.23), (0.21, -0.13, 0.02),
]  # fmt: skip
"""Servoing thesis, table A.7."""

GAZEBO_ANCHORS = [
    (0.6, -0.3, -0.2), (-0.6, 0.3, 0.2), (-0.6, -0.3, 0.2), (0.6, 0.3, -0.2),
    (-0.6, -0.3, -0.2), (0.6, 0.3, 0.2), (0.6, -0.3, 0.2), (-0.6, 0.3, -0.2),
]  # fmt: skip
"""Gazebo thesis, robot file of its simulator; from the middle of the platform."""


@pytest.mark.parametrize("name", robot_names())
def test_loads_and_hangs_still_at_home(name):
    """Five steps; representative robots for 0.2 s."""
    robot = load_robot(name)
    home, block = robot.home.transform(), CableRobot(robot)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, home)
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(len(robot.cables)))
    start = block.GetOutputPort("X_WP").Eval(context)
    step = automatic_step(robot, start, "runge_kutta3")
    ResetIntegratorFromFlags(simulator, "runge_kutta3", step).set_fixed_step_mode(True)
    bounds, off = robot.tension_bounds, BOUND_ROUND_OFF * np.max(robot.stiffness())
    times = [5 * step]
    if name in REPRESENTATIVE_ROBOTS:
        assert max(pose_error(start, home)) < STILL
        times, off = np.linspace(0.02, 0.2, 10), 1e-6
    for time in times:
        simulator.AdvanceTo(time)
        assert max(pose_error(start, block.GetOutputPort("X_WP").Eval(context))) < STILL
        tensions = block.GetOutputPort("tensions").Eval(context)
        assert np.all(tensions >= bounds.lower - off)
        assert np.all(tensions <= bounds.upper + off)


FILLED_IN = {
    "platform.center_of_mass": r"platform\.center_of_mass: |[Cc]entre of mass",
    "platform.inertia": r"platform\.inertia: |[Ii]nertia (from|of) a solid box|inertia is that of",
    "cable_model": r"cable_model: ",
    "damping": r"damping: ",
    "winch.friction": r"winch\.friction: ",
}
"""How the texts name what is filled in, by key."""


@pytest.mark.parametrize("name", robot_names())
def test_says_where_its_numbers_are_from_and_what_was_filled_in(name):
    words = ROBOTS.joinpath(name, "README.md").read_text(encoding="utf-8")
    rows = [line.split("|")[1:3] for line in words.splitlines() if line.startswith("| ")][2:]
    assert len(rows) >= 2
    assert all(source.strip() for _, source in rows)
    named = re.compile(r"thesis|github\.com|WireCenter|assumptions|caroca|published")
    assert any(named.search(source) for _, source in rows)
    content = yaml.safe_load(ROBOTS.joinpath(name, "robot.yaml").read_text(encoding="utf-8"))
    assert content["assumptions"]
    robot = made(name)
    for key, value in robot.filled_in().items():
        assert re.search(FILLED_IN[key], robot.assumptions), f"{key}, {value}"
    assert ("not in its file", "nothing") not in robot.summary()[1] or not robot.filled_in()
    assert {mount.model for mount in robot.cameras} <= set(camera_names())


def test_the_table_of_a_robot_shows_what_was_filled_in():
    rows = dict(load_robot("acrobot_small").summary()[1])
    assert rows["not in its file"] == (
        "platform.center_of_mass: the middle of its box, (0, 0, 0.035) m; platform.inertia: that "
        "of a solid box; cable_model: straight, without weight; damping: none"
    )
    rows = dict(load_robot("caroca").summary()[1])
    assert "damping" not in rows["not in its file"]
    assert "fitted, not printed" in load_robot("caroca").assumptions
    assert "240 N s/m" in load_robot("caroca").assumptions


def test_every_folder_has_a_readme_and_a_robot_of_its_name():
    folders = [entry for entry in ROBOTS.iterdir() if entry.is_dir()]
    assert {folder.name for folder in folders} == {*robot_names(), *mechanism_names()}
    for folder in folders:
        assert folder.joinpath("README.md").read_text(encoding="utf-8").startswith("# ")
        file = "mechanism.yaml" if folder.name in mechanism_names() else "robot.yaml"
        content = yaml.safe_load(folder.joinpath(file).read_text(encoding="utf-8"))
        assert content["name"] == folder.name
    several = ("acrobot", "caroca")  # families of several robots each
    families = {next((s for s in several if name.startswith(s)), name) for name in robot_names()}
    assert len(families) >= 14


@pytest.mark.parametrize(
    ("name", "exits", "anchors", "mass", "size", "modulus", "diameter", "drum", "gear", "speed"),
    [
        ("acrobot_small", UPPER_EXITS, SMALL_ANCHORS, 1.5, (0.11, 0.11, 0.07), 111e9, 2e-3, 0.04,
         10.0, 3000.0),
        ("acrobot_large", UPPER_EXITS, LARGE_ANCHORS, 3.5, (0.18, 0.17, 0.07), 111e9, 2e-3, 0.04,
         10.0, 3000.0),
        ("acrobot_fully_constrained", CONSTRAINED_EXITS, LARGE_ANCHORS, 3.5, (0.18, 0.17, 0.07),
         111e9, 2e-3, 0.04, 10.0, 3000.0),
        ("caroca", CAROCA_EXITS, CAROCA_ANCHORS, 150.0, (0.42, 0.32, 0.23), 102.2e9, 6e-3, 0.06,
         40.0, 2200.0),
    ],
)  # fmt: skip
def test_points_masses_cables_and_winches_are_the_published_ones(
    name, exits, anchors, mass, size, modulus, diameter, drum, gear, speed
):
    """Servoing thesis, appendices A.1.1 and A.1.2: frames of 1.2 m, and of 4 m by 7 m."""
    robot = load_robot(name)
    np.testing.assert_array_equal(robot.exit_points(), np.transpose(exits))
    np.testing.assert_array_equal(robot.anchor_points(), np.transpose(anchors))
    assert robot.platform.mass == mass
    np.testing.assert_array_equal(robot.platform.size, size)
    assert (robot.cable.youngs_modulus, robot.cable.diameter) == (modulus, diameter)
    winch, edges = robot.winch, robot.frame.upper - robot.frame.lower
    assert (winch.drum_radius, winch.gear_ratio, winch.motor_speed_rpm) == (drum, gear, speed)
    assert winch.rated_cable_speed() == pytest.approx(speed * np.pi / 30.0 * drum / gear)
    np.testing.assert_allclose(robot.stiffness(), np.full(8, modulus * np.pi / 4 * diameter**2))
    if name == "caroca":
        np.testing.assert_allclose(edges[:2], [4.0, 7.0])
        return
    # The base frame lies in the middle of the floor; X_PC turns by Rz(180 deg) Rx(180 deg), A.6.1.
    np.testing.assert_allclose(edges, np.full(3, 1.2))
    np.testing.assert_allclose(robot.frame.upper[:2], -robot.frame.lower[:2])
    assert robot.frame.lower[2] == 0.0
    X_PC = robot.camera_mount("onboard").pose.transform()
    np.testing.assert_array_equal(X_PC.translation(), [-0.0631, 0.0, 0.01])
    np.testing.assert_allclose(X_PC.rotation().matrix(), np.diag([-1.0, 1.0, -1.0]), atol=1e-15)


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


def test_printed_tensions_hold_the_large_platform():
    """Servoing thesis, section 1.3.4: the tensions at (0.35, -0.27, 0.45) m balance 3.5 kg."""
    robot, X_WP = load_robot("acrobot_large"), RigidTransform([0.35, -0.27, 0.45])
    W = wrench_matrix(X_WP, robot.exit_points(), robot.anchor_points())
    printed = np.array([2.08, 2.08, 2.43, 2.58, 3.74, 4.30, 12.76, 13.31])
    residual = W @ printed + gravity_wrench(X_WP, 3.5, robot.center_of_mass(), 9.81)
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


def test_cameras_are_the_published_ones():
    """Servoing thesis, tables A.2 to A.5."""
    kowa, astra, webcam = (load_camera(name) for name in ("ids_kowa", "astra", "mt4018"))
    assert (kowa.width, kowa.height, kowa.rate_hz) == (1600, 1200, 60.0)
    assert (kowa.view_angle_horizontal_deg, kowa.view_angle_vertical_deg) == (79.0, 59.4)
    assert (astra.width, astra.height, astra.rate_hz) == (640, 480, 30.0)
    assert (astra.view_angle_horizontal_deg, astra.view_angle_vertical_deg) == (60.0, 49.5)
    # 4.02 mm focal length and pixels of one size: both angles follow from the same pixel size.
    assert (webcam.width, webcam.height) == (1280, 1024)
    pinhole = webcam.pinhole(1280, 1024)
    assert pinhole.fx == pytest.approx(pinhole.fy, rel=0.01)


def test_sensors_are_the_published_ones():
    vlu850 = load_tension_sensor("vlu850")
    np.testing.assert_array_equal(vlu850.limits, [-25.0, 75.0])
    assert (vlu850.accuracy, vlu850.repeatability) == (0.24, 0.01)
    tractel = load_tension_sensor("tractel")
    assert tractel.accuracy == 0.003 * tractel.limits[1] == 75.0
    c_track = load_pose_sensor("c_track")
    assert (c_track.position_accuracy, c_track.rate_hz) == (1e-4, 80.0)
    with pytest.raises(RobotFileError, match=r"'vlu' is unknown; did you mean vlu850\?"):
        load_tension_sensor("vlu")


def test_the_tracker_is_fitted_to_what_is_reported_and_says_so():
    """12 mm at the start and 5 mm at the end of case study I: no comparison, but the fit's own."""
    vive = load_pose_sensor("vive")
    assert "fitted to these two numbers" in " ".join(vive.assumptions.split())
    start = np.hypot(vive.error_per_distance * 0.32, vive.error_per_angle * np.radians(15.6))
    assert start == pytest.approx(0.012, abs=2e-4)
    assert vive.error_per_distance * 0.57 == pytest.approx(0.005, abs=1e-4)


@pytest.mark.parametrize(
    ("names", "load", "change", "words"),
    [
        (tension_sensor_names, load_tension_sensor, {"limits": np.array([5.0, 5.0])},
         r"limits: found \(5, 5\); accepted: smallest < largest"),
        (encoder_names, load_encoder, None, ""),
        (pose_sensor_names, load_pose_sensor, None, ""),
        (inertial_sensor_names, load_inertial_sensor, None, ""),
        (range_sensor_names, load_range_sensor, {"first_angle_deg": 300.0},
         "first_angle_deg: found 300; accepted: <= last_angle_deg"),
        (depth_sensor_names, load_depth_sensor, {"limits": np.array([5.0, 1.0])},
         r"limits: found \(5, 1\); accepted: smallest < largest"),
    ],
)  # fmt: skip
def test_every_sensor_loads_and_names_itself_and_refuses_what_none_is(names, load, change, words):
    for name in names():
        assert load(name).name == name
        assert load(name).source
    if change:
        with pytest.raises(DataFileError, match=words):
            refuse(replace(load(names()[0]), **change))


@pytest.mark.parametrize("top", ["cdpr_drake", "systems", "analyses", "notebooks", "README.md"])
def test_bare_points_do_not_leave_the_models(top):
    """Cables go as a `CableSet`, so that pulleys cannot get lost."""
    # rglob does not follow the links cdpr_drake/{models,systems,analyses}.
    root = Path(__file__).parents[2] / top
    paths = [path for path in root.rglob("*") if path.suffix in (".py", ".ipynb")]
    for path in paths or [root]:
        found = re.search(r"\.(exit_points|anchor_points)\(\)", path.read_text())
        assert found is None, f"{path}: {found}"
