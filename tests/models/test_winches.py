"""The winches of a robot file: from YAML to laws, and what is refused."""

import numpy as np
import pytest
import yaml

from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.models.winch_schema import Friction, Winch
from cdpr_drake.winches.drum import Drum
from cdpr_drake.winches.friction import FrictionLaw
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS


def robot_with(folder, **winch):
    content = yaml.safe_load(robot_file("acrobot_small").read_text())
    content["winch"].update(winch)
    path = folder / "robot.yaml"
    path.write_text(yaml.safe_dump(content))
    return str(path)


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_every_robot_that_comes_with_the_package_has_motors(name):
    robot = load_robot(name)
    law = robot.winch_law()
    assert law.drum.radius == robot.winch.drum_radius + robot.cable.diameter / 2.0
    assert law.rated_speed == pytest.approx(robot.winch.motor_speed_rpm * np.pi / 30.0)
    assert 0.0 < law.friction.coulomb <= law.friction.static


def test_a_file_with_every_section_becomes_a_law(tmp_path):
    friction = {"coulomb": 0.01, "static": 0.02, "viscous": 1e-4, "stribeck_speed": 3.0}
    path = robot_with(
        tmp_path,
        motor_torque=0.5,
        inertia=2e-5,
        friction=friction,
        layers={"turns": 10.0, "wound": 1.5},
        brake_torque=1.0,
        loops={"velocity_bandwidth": 300.0, "position_bandwidth": 40.0},
    )
    law = load_robot(path).winch_law()
    assert law.drum == Drum(0.041, 10.0, 10.0, 0.002, 1.5)
    assert law.friction == FrictionLaw(0.01, 0.02, 1e-4, 3.0, 1e-3)
    assert (law.inertia, law.rated_torque, law.brake_torque) == (2e-5, 0.5, 1.0)
    assert (law.velocity_bandwidth, law.position_bandwidth) == (300.0, 40.0)


def test_what_is_left_out_does_not_limit():
    winch = Winch(drum_radius=0.04, gear_ratio=10.0, motor_speed_rpm=3000.0)
    assert winch.law(0.002) is None
    winch.inertia = 1e-5
    law = winch.law(0.002)
    assert law.rated_torque == np.inf
    assert law.friction == FrictionLaw()
    assert not law.drum.has_layers()
    assert law.brake_torque == 0.0
    assert (law.velocity_bandwidth, law.position_bandwidth) == (200.0, 20.0)
    winch.friction = Friction(coulomb=0.01, static=0.02, stribeck_speed=3.0)
    assert winch.law(0.002).friction == FrictionLaw(0.01, 0.02, 0.0, 3.0, 1e-3)


@pytest.mark.parametrize(
    ("winch", "message"),
    [
        (
            {"friction": {"coulomb": -0.01, "static": 0.02, "stribeck_speed": 3.0}},
            r"winch\.friction\.coulomb: found -0\.01; accepted: a number >= 0 \[N m\]",
        ),
        (
            {"friction": {"coulomb": 0.03, "static": 0.02, "stribeck_speed": 3.0}},
            r"winch\.friction\.static: found 0\.02; accepted: at least coulomb = 0\.03 \[N m\]",
        ),
        (
            {"friction": {"coulomb": 0.01, "static": 0.02, "stribeck_speed": 0.0}},
            r"winch\.friction\.stribeck_speed: found 0\.0; accepted: a number > 0 \[rad/s\]",
        ),
        ({"inertia": 0.0}, r"winch\.inertia: found 0\.0; accepted: a number > 0 \[kg m\^2\]"),
        ({"brake_torque": -1.0}, r"winch\.brake_torque: found -1\.0; accepted: a number > 0"),
        (
            {"layers": {"turns": 0.5, "wound": 1.0}},
            r"winch\.layers\.turns: found 0\.5; accepted: a number >= 1",
        ),
    ],
)
def test_impossible_winches_are_named(tmp_path, winch, message):
    with pytest.raises(RobotFileError, match=message):
        load_robot(robot_with(tmp_path, **winch))
