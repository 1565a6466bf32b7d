"""What files, formats, commands and analyses do not take of a motion type is refused by name."""

import re

import numpy as np
import pytest
import yaml
from pydrake.math import RigidTransform

from cdpr_drake import formats
from cdpr_drake.analyses.statics.robot_at_rest import static_at_pose
from cdpr_drake.analyses.workspaces.pose_grid import check_grid
from cdpr_drake.cli.app import main
from cdpr_drake.errors import (
    CableModelError,
    ForwardKinematicsError,
    InfeasibleTensionError,
    RobotFileError,
    StabilityError,
    TensionProblemError,
)
from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import wrench_balance
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.systems.controllers.computed_torque import platform_dynamics
from cdpr_drake.systems.robots.cable_forces import simulated_cables
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings
from cdpr_drake.workspaces.pose_grid import grid_by_count
from tests.messages import printed
from tests.motion.small_robots import BEAM, MOTIONS, POINT, content, small_robot


@pytest.mark.parametrize("name", MOTIONS)
def test_every_small_robot_is_accepted(name):
    robot = small_robot(name)
    assert robot.motion_type().freedom <= 6
    assert np.linalg.norm(robot.down()) == pytest.approx(1.0)


def test_gravity_is_a_vector():
    np.testing.assert_allclose(load_robot("caroca").gravity_vector(), [0.0, 0.0, -9.81])
    g = small_robot("tilted_gravity").gravity_vector()
    np.testing.assert_allclose(g, 9.81 * np.array([0.3, -0.2, -1.0]) / np.sqrt(1.13))


@pytest.mark.parametrize(
    ("name", "changes", "field", "accepted"),
    [
        ("tripod", {"platform": POINT | {"center_of_mass": [0, 0, 0.1]}},
         "platform.center_of_mass", "Po, 0 0 0, of a point mass, 3T"),
        ("hanging_four", {"motion": "3T"}, "cables[0].anchor_point",
         "Po, 0 0 0, of a point mass, 3T"),
        ("tripod", {"axis": [1, 0, 0]}, "axis", "null for 3T"),
        ("slope", {"axis": [0, 0, 0]}, "axis",
         "3 numbers, not all zero [-] or null"),
        ("upright_point", {"plane_height": 0.3}, "plane_height",
         "a height for robots in a horizontal plane, null for others"),
        ("upright_body", {"home": {"position": [0.1, 0.2, 0.3], "angles_deg": [10, 0, 0]}},
         "home.angles_deg", "a turn about the plane's normal (0, 1, 0)"),
        ("beam", {"axis": [1, 0, 0]}, "cables[0].anchor_point",
         "a point of the beam's axis, through Po along (1, 0, 0)"),
        ("beam", {"platform": BEAM | {"size": [0.05, 0.08, 0.6]}}, "platform.inertia",
         "that of a body of revolution about (0, 0, 1); its spin is no matter"),
        ("tilted_gravity", {"gravity_direction": [0, 0, 0]}, "gravity_direction",
         "3 numbers, not all zero [-]"),
    ],
)  # fmt: skip
def test_refusal_of_a_file(name, changes, field, accepted):
    with pytest.raises(RobotFileError) as caught:
        small_robot(name, **changes)
    first = str(caught.value).splitlines()[0]
    assert re.match(rf"{name}\.yaml:\d+: {re.escape(field)}: found ", first)
    assert first.endswith(f"; accepted: {accepted}")


def simulated(kind, name):
    settings = CableRobotSettings(cables=CableSettings(model="catenary"))
    return kind(small_robot(name), settings)


def on_grid(name):
    grid = grid_by_count(-np.ones(3), np.ones(3), (3, 3, 3))
    return check_grid(small_robot(name), grid)


def lengths_alone(name):
    robot = small_robot(name)
    assert robot.is_underactuated()
    return ForwardKinematics(robot.cable_set().without_pulleys(), robot.motion_type())


def static_at_home(name):
    robot = small_robot(name)
    return static_at_pose(robot, robot.home.transform(), "elastic", False)


OBLIQUE = {"gravity_direction": [0.0, -0.1, -1.0]}
TURNED = r"with axis .*; accepted for caspr.* in the world that was turned by 5\.71"
EXPORTS = [
    ("caspr", "slope", "motions are along axes of W"),
    ("caspr", "beam", "motions are along axes of W"),
    ("wcrfx", "upright_body", "or with it along z"),
    ("mjcf", "beam", "all types but 2R3T"),
    ("sdf", "tripod", "accepted for sdf: 3R3T"),
]


@pytest.mark.parametrize(("format", "name", "words"), EXPORTS)
def test_refusal_of_a_format(format, name, words):
    with pytest.raises(RobotFileError, match=words):
        formats.export_robot(small_robot(name), format)


CALLS = [
    (
        RobotFileError, TURNED,
        lambda name: formats.export_robot(small_robot(name, **OBLIQUE), "caspr"), "upright_body",
    ),
    (StabilityError, "its plane y = 0.2", on_grid, "upright_body"),
    (StabilityError, "its line x = 0.3", on_grid, "lift"),
    (InfeasibleTensionError, "4 cables for 6 degrees of freedom", static_at_home, "hanging_four"),
    *(
        (ForwardKinematicsError, "the pose follows from equilibrium", lengths_alone, name)
        for name in ("hanging_four", "tilted_gravity")
    ),
    *(
        (CableModelError, "gravity along", lambda name, k=kind: simulated(k, name), name)
        for kind in (CableRobot, CompiledCableRobot)
        for name in ("upright_body", "slope", "tilted_gravity")
    ),
    *(
        (
            RobotFileError, "accepted by computed torque",
            lambda name: platform_dynamics(small_robot(name)), name,
        )
        for name in ("tripod", "upright_body", "tilted_gravity")
    ),
]  # fmt: skip


@pytest.mark.parametrize(("error", "words", "call", "name"), CALLS)
def test_refusal(error, words, call, name):
    with pytest.raises(error, match=words):
        call(name)


def test_what_is_near_a_refusal_is_accepted():
    on_grid("tripod")
    assert simulated_cables(small_robot("tripod").cable_set(), "elastic").count == 3
    in_plane = small_robot("upright_body", gravity_direction=[0.1, 0.0, -1.0])
    assert "PLANAR_XZ" in "".join(formats.export_robot(in_plane, "caspr").values())


@pytest.mark.parametrize(
    ("name", "turn", "p"),
    [
        ("upright_body", 0.0, [0.1, 0.9, 0.3]),
        ("upright_body", 0.1, [0.1, 0.2, 0.3]),
        ("slope", 0.0, [0.3, 0.1, 0.6]),
        ("level_point", 0.0, [0.2, 0.0, 0.4]),
    ],
)
def test_a_pose_that_a_robot_cannot_have_is_refused(name, turn, p):
    robot, X_WP = small_robot(name), RigidTransform(rotation_from_vector(np.array([turn, 0, 0])), p)
    with pytest.raises(TensionProblemError, match="cannot have"):
        static_at_pose(robot, X_WP, "elastic", False)
    near = robot.joint().nearest(X_WP)
    assert robot.joint().nearest(near).IsNearlyEqualTo(near, 1e-12)
    wrench_balance(robot, near)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("tension {pendulum} --pose 0,0,0.5 --method dykstra", "quadratic_program"),
        ("workspace {beam}", "motions along axes of W, and not 2R3T"),
        ("workspace {slope}", "motions along axes of W, and not 2R3T"),
        ("workspace {hanging_four}", "found 4 for 6 degrees of freedom"),
        ("stability {tripod}", "accepted by stability: 3R3T, or 2T1R in a horizontal plane"),
        ("simulate acrobot_pbvs --set robot={tripod}", "accepted by scenarios: 3R3T, or 2T1R in a"),
        (
            "static {hanging_four} --pose 0,0,0.3",
            "4 cables for 6 degrees of freedom, does not rest at",
        ),
    ],
)
def test_refusal_of_a_command(arguments, words, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for name in MOTIONS:
        if f"{{{name}}}" in arguments:
            path = tmp_path / f"{name}.yaml"
            path.write_text(yaml.safe_dump(content(name)), encoding="utf-8")
    with pytest.raises(SystemExit) as caught:
        main([word.format(**{n: str(tmp_path / f"{n}.yaml") for n in MOTIONS})
              for word in arguments.split()])  # fmt: skip
    assert caught.value.code == 2
    _, message = printed(capsys)
    assert words in " ".join(message.split())
    assert len(message.strip().splitlines()) == 1
