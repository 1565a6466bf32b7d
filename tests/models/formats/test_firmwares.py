"""Machines as firmwares of printers and routers know them, by the laws of these firmwares."""

import re

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_exchange import export_robot
from cdpr_drake.models.robot_loader import load_robot
from tests.models.formats.foreign_files import REPRAP, saved

BUILT_UP = (
    REPRAP.replace("Q0.0", "Q0.0356")
    .replace("U2:2:2:2", "U2:2:2:4")
    .replace("R65.0:65.0:65.0:65.0", "R65.24:65.14:65.3:64.67")
)
R, ADVANTAGE = [65.24, 65.14, 65.3, 64.67], np.array([2.0, 2.0, 2.0, 4.0])


@pytest.fixture
def load(tmp_path):
    return lambda name, text: load_robot(str(saved(name, text)(tmp_path)))


@pytest.fixture
def again(load):
    """A robot that went out to a format and in again, and the text."""

    def exported(robot, format):
        ((name, text),) = export_robot(robot, format).items()
        return load(f"again_{name}", text), text

    return exported


def test_motors_turn_as_far_as_the_firmware_turns_them(load, again):
    """Drums, tackles and build-up against HangprinterKinematics.cpp's k0, k1, k2 [mm]."""
    robot = load("config.g", BUILT_UP)
    assert [cable.mechanical_advantage for cable in robot.cables] == ADVANTAGE.tolist()
    origin, Q = np.linalg.norm(robot.exit_points(), axis=0), 0.0356
    k2 = -ADVANTAGE * Q
    k1 = np.square(R) + Q * ADVANTAGE * 1e3 * origin
    k0 = 2.0 * ADVANTAGE * 12.75 / k2
    other, text = again(robot, "reprapfirmware")
    for point in ([0.2, -0.3, 0.5], [-0.4, 0.1, 1.2], [0.6, 0.7, 0.1]):
        lengths = np.linalg.norm(robot.exit_points().T - point, axis=1)
        firmware = k0 * (np.sqrt(k1 + 1e3 * lengths * k2) - np.sqrt(k1 + 1e3 * origin * k2))
        for drum in (robot.drum(), other.drum()):
            np.testing.assert_allclose(drum.motor_angles(lengths - origin), firmware, rtol=1e-9)
    numbers = re.search(r"M666 Q(\S+) R(\S+) U(\S+)", text)
    assert float(numbers[1]) == pytest.approx(Q, rel=1e-12)
    radii = [float(each) for each in numbers[2].split(":")]
    np.testing.assert_allclose(radii, R, rtol=1e-12)
    assert numbers[3] == "2:2:2:4"
    np.testing.assert_allclose(other.drum().radii(4), robot.drum().radii(4), rtol=1e-12)
    assert other.winch.layers.wound == pytest.approx(robot.winch.layers.wound)


def test_the_drums_of_the_catalogue_are_read_back(again):
    catalogue = load_robot("hangprinter_4")
    other, _ = again(catalogue, "reprapfirmware")
    for paid_out in (np.zeros(4), np.full(4, 0.4), np.full(4, -0.7)):
        found, expected = (r.drum().motor_angles(paid_out) for r in (other, catalogue))
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


SLED = """kinematics: {MaslowKinematics: {tlX: 0, tlY: 2000, tlZ: 100, trX: 3000, trY: 2000,
  trZ: 56, blX: 0, blY: 0, blZ: 34, brX: 3000, brY: 0, brZ: 78, beltEndExtension: 30,
  armLength: 123.4}}
"""


@pytest.mark.parametrize("upright", [False, True])
def test_maslow_s_arms_stay_level(upright, load, again):
    """By the firmware's formula: the distance in the board, less the arms, and the height."""
    sled = load("sled.yaml", SLED + f"Maslow_vertical: {str(upright).lower()}\n")
    assert sled.pulley.arm == pytest.approx(0.1534)
    far, heights = np.hypot([0.5, 2.5, 0.5, 2.5], [0.4, 0.4, 1.6, 1.6]), [0.1, 0.056, 0.034, 0.078]
    X_WP = RigidTransform([0.5, 0.0, 1.6] if upright else [0.5, 1.6, 0.0])
    lengths = cable_paths(X_WP, sled.cable_set()).lengths
    np.testing.assert_allclose(lengths, np.hypot(far - 0.1534, heights), rtol=1e-12)
    assert 1e3 * lengths[0] == pytest.approx(497.08, abs=0.005)
    other, _ = again(sled, "maslow")
    np.testing.assert_allclose(cable_paths(X_WP, other.cable_set()).lengths, lengths, rtol=1e-12)


def test_older_maslow_belts_go_straight_to_the_middle(load):
    given = {"tlX": 0, "tlY": 2000, "trX": 3000, "trY": 2000, "brX": 3000, "brY": 0, "blY": 0}
    given["armLength"] = 120
    old = load("old.yaml", "".join(f"Maslow_{key}: {value}\n" for key, value in given.items()))
    assert old.pulley.arm == 0.0


def test_maslow_s_belt_is_as_stiff_as_its_makers_say():
    assert load_robot("maslow_4").stiffness() == pytest.approx([178.9e3] * 4, rel=1e-5)
