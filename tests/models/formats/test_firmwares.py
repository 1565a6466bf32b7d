"""Machines as firmwares of printers and routers on cables know them."""

import re

import numpy as np
import pytest
from pydrake.math import RigidTransform
from scipy.io import savemat

from cdpr_drake.errors import RobotFileError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.formats.grab_mat import is_grab_mat
from cdpr_drake.models.robot_exchange import export_robot, import_robot
from cdpr_drake.models.robot_loader import load_robot

KLIPPER = """[printer]
kinematics: winch
max_velocity: 300
max_accel: 3000
""" + "".join(
    f"[stepper_{letter}]\nstep_pin: PF0 # a comment\nrotation_distance: 40\ngear_ratio: 51:4\n"
    f"anchor_x: {x}\nanchor_y: {y}\nanchor_z: {z}\n"
    for letter, (x, y, z) in zip(
        "abcd", [(0, -2000, -100), (2000, 1000, -100), (-2000, 1000, -100), (0, 0, 3000)],
        strict=True,
    )
)  # fmt: skip

REPRAP = """; Hangprinter
M669 K6 N4 A0.0:-1604.5:-114.1 B1312.5:1270.9:-162.2 C-1440.3:741.6:-161.2 D0:0:2345.0 P2000
M666 Q0.0 R65.0:65.0:65.0:65.0 U2:2:2:2 O1:1:1:1 L20:20:20:20 H255:255:255:255 J200:200:200:200
M666 W2.5 S20000 I4:4:4:4 X90:90:90:90
"""

MASLOW = """Maslow_vertical: true
kinematics:
  MaslowKinematics:
    tlX: 100.0
    tlY: 2400.0
    tlZ: 100.0
    trX: 3600.0
    trY: 2410.0
    trZ: 56.0
    blX: 0.0
    blY: 0.0
    blZ: 34.0
    brX: 3610.0
    brY: 0.0
    brZ: 78.0
    beltEndExtension: 30.0
    armLength: 123.4
"""


@pytest.fixture
def load(tmp_path):
    def loaded(name, text):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return load_robot(str(path))

    return loaded


def test_klipper(load):
    robot = load("printer.cfg", KLIPPER)
    assert robot.motion == "3T"
    np.testing.assert_allclose(robot.exit_points()[:, 1], [2.0, 1.0, -0.1])
    assert robot.winch.gear_ratio == pytest.approx(12.75)
    assert robot.winch.drum_radius == pytest.approx(0.04 / (2.0 * np.pi))
    assert robot.winch.rated_cable_speed() == pytest.approx(0.3)
    assert [cable.name for cable in robot.cables] == ["A", "B", "C", "D"]


def test_reprapfirmware(load):
    robot = load("config.g", REPRAP)
    np.testing.assert_allclose(robot.exit_points()[:, 3], [0.0, 0.0, 2.345])
    assert robot.winch.gear_ratio == pytest.approx(255.0 / 20.0)
    assert [cable.mechanical_advantage for cable in robot.cables] == [2.0] * 4
    assert robot.winch.drum_radius == pytest.approx(0.065 - 0.5e-3)
    assert robot.platform.mass == 2.5
    np.testing.assert_allclose(robot.stiffness(), 20000.0)
    assert (robot.tension_bounds.lower, robot.tension_bounds.upper) == (4.0, 90.0)


BUILT_UP = (
    REPRAP.replace("Q0.0", "Q0.0356")
    .replace("U2:2:2:2", "U2:2:2:4")
    .replace("R65.0:65.0:65.0:65.0", "R65.24:65.14:65.3:64.67")
)


def test_motors_turn_as_far_as_the_firmware_turns_them(load):
    """Drums, tackles and build-up against the firmware's own law of a motor's position."""
    robot = load("config.g", BUILT_UP)
    drum, advantage = robot.drum(), np.array([2.0, 2.0, 2.0, 4.0])
    assert [cable.mechanical_advantage for cable in robot.cables] == advantage.tolist()
    origin, R = np.linalg.norm(robot.exit_points(), axis=0), [65.24, 65.14, 65.3, 64.67]
    for point in ([0.2, -0.3, 0.5], [-0.4, 0.1, 1.2], [0.6, 0.7, 0.1]):
        lengths = np.linalg.norm(robot.exit_points().T - point, axis=1)
        Q, squares = 0.0356, np.square(R)
        k2 = -advantage * Q  # mm, as HangprinterKinematics.cpp has k0, k1, k2
        k1 = squares + Q * advantage * 1e3 * origin
        k0 = 2.0 * advantage * 12.75 / k2
        firmware = k0 * (np.sqrt(k1 + 1e3 * lengths * k2) - np.sqrt(k1 + 1e3 * origin * k2))
        np.testing.assert_allclose(drum.motor_angles(lengths - origin), firmware, rtol=1e-9)


def test_drums_tackles_and_build_up_are_read_back(load):
    robot = load("config.g", BUILT_UP)
    ((name, text),) = export_robot(robot, "reprapfirmware").items()
    numbers = re.search(r"M666 Q(\S+) R(\S+) U(\S+)", text)
    assert float(numbers[1]) == pytest.approx(0.0356, rel=1e-12)
    radii = [float(each) for each in numbers[2].split(":")]
    np.testing.assert_allclose(radii, [65.24, 65.14, 65.3, 64.67], rtol=1e-12)
    assert numbers[3] == "2:2:2:4"
    again = load(f"again_{name}", text)
    np.testing.assert_allclose(again.drum().radii(4), robot.drum().radii(4), rtol=1e-12)
    assert again.winch.layers.wound == pytest.approx(robot.winch.layers.wound)
    catalogue = load_robot("hangprinter_4")
    ((name, text),) = export_robot(catalogue, "reprapfirmware").items()
    read, still = load(f"catalogue_{name}", text), np.zeros(4)
    for paid_out in (still, still + 0.4, still - 0.7):
        np.testing.assert_allclose(
            read.drum().motor_angles(paid_out), catalogue.drum().motor_angles(paid_out),
            rtol=1e-9, atol=1e-12,
        )  # fmt: skip


def test_the_last_anchor_of_older_firmware_is_a_height(load):
    robot = load("config.g", REPRAP.replace("D0:0:2345.0", "D2345.0"))
    np.testing.assert_allclose(robot.exit_points()[:, 3], [0.0, 0.0, 2.345])


def test_a_maslow_on_a_wall_and_on_the_floor(load):
    wall = load("maslow.yaml", MASLOW)
    np.testing.assert_allclose(wall.exit_points()[:, 0], [0.1, 0.1, 2.4])
    np.testing.assert_allclose(wall.axis, [0.0, 1.0, 0.0])
    floor = load("floor.yaml", MASLOW.replace("true", "false"))
    np.testing.assert_allclose(floor.exit_points()[:, 0], [0.1, 2.4, -0.1])
    old = load("old.yaml", "Maslow_vertical: false\n" + "".join(
        f"Maslow_{line.strip()}\n" for line in MASLOW.splitlines()[3:15] if "bl" not in line
    ))  # fmt: skip
    np.testing.assert_allclose(old.exit_points()[:, (0, 1, 3)], floor.exit_points()[:, (0, 1, 3)])


SLED = """kinematics: {MaslowKinematics: {tlX: 0, tlY: 2000, tlZ: 100, trX: 3000, trY: 2000,
  trZ: 56, blX: 0, blY: 0, blZ: 34, brX: 3000, brY: 0, brZ: 78, beltEndExtension: 30,
  armLength: 123.4}}
"""


@pytest.mark.parametrize("upright", [False, True])
def test_maslow_s_arms_stay_level(upright, load):
    """By the firmware's formula: the distance in the board, less the arms, and the height."""
    sled = load("sled.yaml", SLED + f"Maslow_vertical: {str(upright).lower()}\n")
    assert sled.pulley.arm == pytest.approx(0.1534)
    far, heights = np.hypot([0.5, 2.5, 0.5, 2.5], [0.4, 0.4, 1.6, 1.6]), [0.1, 0.056, 0.034, 0.078]
    X_WP = RigidTransform([0.5, 0.0, 1.6] if upright else [0.5, 1.6, 0.0])
    lengths = cable_paths(X_WP, sled.cable_set()).lengths
    np.testing.assert_allclose(lengths, np.hypot(far - 0.1534, heights), rtol=1e-12)
    assert 1e3 * lengths[0] == pytest.approx(497.08, abs=0.005)
    ((name, text),) = export_robot(sled, "maslow").items()
    again = load(f"again_{name}", text)
    np.testing.assert_allclose(cable_paths(X_WP, again.cable_set()).lengths, lengths, rtol=1e-12)


def test_older_maslow_belts_go_straight_to_the_middle(tmp_path):
    path = tmp_path / "old.yaml"
    given = {"tlX": 0, "tlY": 2000, "trX": 3000, "trY": 2000, "brX": 3000, "brY": 0, "blY": 0}
    given["armLength"] = 120
    path.write_text("".join(f"Maslow_{key}: {value}\n" for key, value in given.items()))
    imported = import_robot(path)
    assert imported.robot.pulley.arm == 0.0
    assert any("120 mm before the middle" in words for words in imported.completed.remarks)


def test_maslow_s_belt_is_as_stiff_as_its_makers_say():
    assert load_robot("maslow_4").stiffness() == pytest.approx([178.9e3] * 4, rel=1e-5)


@pytest.mark.parametrize(
    ("format", "name", "text"),
    [
        ("klipper", "a.cfg", KLIPPER),
        ("reprapfirmware", "a.g", REPRAP),
        ("maslow", "a.yaml", MASLOW),
    ],
)
def test_what_is_written_is_read_back(format, name, text, load):
    robot = load(name, text)
    ((again_name, again_text),) = export_robot(robot, format).items()
    again = load(f"again_{again_name}", again_text)
    np.testing.assert_allclose(again.exit_points(), robot.exit_points(), atol=1e-12)
    assert [c.name for c in again.cables] == [c.name for c in robot.cables]
    if format != "maslow":
        assert again.winch.gear_ratio == pytest.approx(robot.winch.gear_ratio)
        assert again.winch.drum_radius == pytest.approx(robot.winch.drum_radius)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.cfg", KLIPPER.replace("winch", "delta"), "kinematics: found delta; accepted: winch"),
        ("a.cfg", KLIPPER.replace("anchor_y: 1000", "", 1), "stepper_b.anchor_y: found nothing"),
        ("a.cfg", KLIPPER.replace("51:4", "51", 1), "gear_ratio: found 51; accepted: motor:drum"),
        ("a.cfg", KLIPPER.partition("[stepper_c]")[0], "found 2 winches; accepted: at least 3"),
        ("a.cfg", "no sections", "sections: found"),
        ("a.g", REPRAP.replace("K6", "K3"), "M669 K: found 3.0; accepted: 6"),
        ("a.g", REPRAP.replace("B1312.5:", "B"), "M669 B: found 1270.9:-162.2; accepted: x:y:z"),
        ("a.g", REPRAP.replace("N4", "N5"), "found anchors A, B, C, D and N 5"),
        ("a.g", REPRAP.replace("R65.0:65.0:65.0:", "R65.0:"), "M666 R: found 2 numbers"),
        ("a.g", REPRAP.replace("Q0.0", "Q-1"), "M666 Q: found -1.0; accepted: at least 0"),
        ("a.g", REPRAP.replace("Q0.0", "Q900"), "M666 Q: found 900.0; accepted: so little that"),
        ("a.g", REPRAP.replace("Q0.0", "Q.1").replace("O1:", "O2:"), "M666 O: found 2:1:1:1; acc"),
        ("a.g", "G28\n", "M669: found nothing"),
        ("a.yaml", MASLOW.replace("trX: 3600.0", "trX: wide"), "trX: found wide; accepted: a fin"),
        ("a.yaml", MASLOW.replace("true", "perhaps"), "Maslow_vertical: found perhaps"),
    ],
)
def test_what_is_wrong_is_said(name, text, words, load):
    with pytest.raises(RobotFileError, match=words) as refused:
        load(name, text)
    assert "\n" not in str(refused.value)


def grab_robot(**changes):
    """A robot of GRAB's MATLAB tools, as they nest it."""
    frame = np.empty(3, object)
    frame[:] = [np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])]
    points, pulleys = np.empty(4, object), np.empty(4, object)
    for k in range(4):
        x, y = [(1, -1), (1, 1), (-1, 1), (-1, -1)][k]
        points[k] = np.array([0.1 * x, 0.1 * y, 0.2])
        pulleys[k] = {"r": 0.03, "CableEnterPosition": [x, y, 1.8], "FixedFrame": frame}
    platform = {"m": 12.0, "PtoG": [0.0, 0.0, 0.15], "points": points,
                "InertialMatrix": np.diag([0.2, 0.1, 0.25]), **changes}  # fmt: skip
    return {"EndEffector": {"Platform": platform}, "Trasmission": {"Pulley": pulleys}}


def test_robots_of_grab_in_matlab(tmp_path):
    path = tmp_path / "robot.mat"
    savemat(path, {"s": grab_robot()})
    assert is_grab_mat(path)
    robot = load_robot(str(path))
    assert robot.platform.mass == 12.0
    np.testing.assert_allclose(robot.exit_points()[:, 2], [-1.0, 1.0, 1.8])
    np.testing.assert_allclose(robot.cable_set().swivel_axis[:, 0], [1.0, 0.0, 0.0])
    savemat(path, {"s": grab_robot(m=[1.0, 2.0])})
    with pytest.raises(RobotFileError, match=r"Platform.m: found .*; accepted: 1 finite numbers"):
        load_robot(str(path))
