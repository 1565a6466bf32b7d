"""Robots go out to other tools and come back, and the tools agree on where they are."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator

from cdpr_drake import models
from cdpr_drake.cli.app import main
from cdpr_drake.errors import RobotFileError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.straight_cables import cable_lengths
from tests.messages import printed

EXACT = 1e-12
"""Text has all digits; rotations round a few times."""

SAME_MOTION = 1e-9
"""Two plants of the same bodies, whose constraints are solved to rounding [m]."""

FIRMWARES = ("klipper", "reprapfirmware", "maslow")  # which know points alone, see test_firmwares

ALL = [
    (robot, format)
    for robot in ("acrobot_large", "caroca", "planar")
    for format in models.EXPORTS
    if format not in FIRMWARES and (robot != "planar" or format in ("mjcf", "wcrfx", "caspr"))
]


def written(robot, format, folder):
    """The first file of a robot in a format."""
    for name, text in models.export_robot(robot, format).items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder / next(iter(models.export_robot(robot, format)))


@pytest.mark.parametrize(("name", "format"), ALL)
def test_what_was_written_is_read_again(name, format, tmp_path):
    if format == "mjcf":
        pytest.importorskip("mujoco")
    robot = models.load_robot(name)
    again = models.load_robot(str(written(robot, format, tmp_path)))
    # The simulator's platform frame lies in the middle of the box.
    shift = robot.box_center() if format == "gazebo-yaml" else np.zeros(3)
    ours, theirs = robot.cable_set(), again.cable_set()
    np.testing.assert_allclose(theirs.p_WA, ours.p_WA, atol=EXACT)
    np.testing.assert_allclose(theirs.p_PB, ours.p_PB - shift[:, np.newaxis], atol=EXACT)
    assert again.platform.mass == robot.platform.mass
    assert again.motion == robot.motion
    if format == "wcrfx":
        np.testing.assert_allclose(theirs.pulley_radius, ours.pulley_radius, atol=EXACT)
        np.testing.assert_allclose(theirs.swivel_axis, ours.swivel_axis, atol=EXACT)
        assert again.winch.gear_ratio == robot.winch.gear_ratio
        assert again.cable.diameter == robot.cable.diameter
        assert again.cable.youngs_modulus == robot.cable.youngs_modulus
    else:
        X_WP = robot.home.transform() @ RigidTransform(shift)
        found = again.home.transform().GetAsMatrix4()
        np.testing.assert_allclose(found, X_WP.GetAsMatrix4(), atol=EXACT)
    if format not in ("sdf", "sdf-drake", "urdf", "drake"):
        assert again.tension_limits() == robot.tension_limits()
    elif format not in ("urdf", "drake"):
        assert again.tension_limits()[1] == robot.tension_limits()[1]
    if format != "gazebo-yaml":
        np.testing.assert_allclose(
            models.platform_inertia(again).CopyToFullMatrix6(),
            models.platform_inertia(robot).CopyToFullMatrix6(),
            atol=EXACT * robot.platform.mass,
        )


def test_mujoco_hangs_the_robot_at_its_home_pose(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    robot = models.load_robot("acrobot_large")
    model = mujoco.MjModel.from_xml_path(str(written(robot, "mjcf", tmp_path)))
    data = mujoco.MjData(model)
    cables, X_WP = robot.cable_set(), robot.home.transform()
    mujoco.mj_forward(model, data)
    lengths = cable_lengths(X_WP, cables.p_WA, cables.p_PB)
    np.testing.assert_allclose(data.ten_length, lengths, atol=EXACT)
    # At rest: what is left of gravity is rounding of tensions.
    assert np.max(np.abs(data.qacc)) < 1e-6 * robot.gravity
    for _ in range(200):
        mujoco.mj_step(model, data)
    np.testing.assert_allclose(data.ten_length, lengths, atol=1e-6)


def length_over_caspr_pulley(entry, to, anchor, radius):
    """Length from the point where the cable enters a pulley that swivels about its way there.

    Source: CASPR, BaseRotatingPulleyAttachment.ComputePulleyLeavingLocation.
    """
    normal = np.cross(to, anchor - entry)
    across = np.cross(normal, to)
    centre = entry + radius * across / np.linalg.norm(across)
    share = radius / np.linalg.norm(anchor - centre)
    side = np.cross(normal / np.linalg.norm(normal), anchor - centre)
    leaves = centre + share**2 * (anchor - centre) - share * np.sqrt(1.0 - share**2) * side
    arc = np.arccos((entry - centre) @ (leaves - centre) / radius**2)
    return np.linalg.norm(anchor - leaves) + radius * arc


@pytest.mark.parametrize("name", ["caroca", "ipanema_1", "grab_four"])
def test_caspr_has_cables_as_long_over_its_pulleys(name, tmp_path):
    robot = models.load_robot(name)
    files = models.export_robot(robot, "caspr")
    cables = ET.fromstring(files[f"{name}_cables.xml"].partition("?>")[2])
    X_WP, found = robot.home.transform(), []
    for cable in cables.iter("cable_ideal"):
        pulley, anchor = cable.find("attachments")
        point, to = (
            np.array(pulley.findtext(key).split(), float)
            for key in ("fixed_location", "cable_entry_vector")
        )
        p_WB = X_WP.multiply(np.array(anchor.findtext("location").split(), float))
        radius = float(pulley.findtext("pulley_radius"))
        found.append(length_over_caspr_pulley(point, to, p_WB, radius))
    np.testing.assert_allclose(found, cable_paths(X_WP, robot.cable_set()).lengths, atol=EXACT)


@pytest.mark.parametrize("format", ["sdf", "sdf-drake"])
def test_sdformat_finds_no_error(format, tmp_path):
    """By its library, which Drake's parser calls; here all that it warns of is an error."""
    path = written(models.load_robot("caroca"), format, tmp_path)

    def parse():
        plant = MultibodyPlant(0.0)
        parser = Parser(plant)
        parser.SetStrictParsing()
        return len(parser.AddModels(str(path)))

    assert parse() > 0
    wrong = path.read_text(encoding="utf-8").replace("<mass>", "<mass>x", 1)
    path.write_text(wrong, encoding="utf-8")
    with pytest.raises(RuntimeError, match="mass"):
        parse()


def test_links_of_the_same_name_in_a_model_beside_it_are_not_the_frame(tmp_path):
    path = written(models.load_robot("acrobot_large"), "sdf", tmp_path)
    beside = '<model name="beside"><link name="frame"/><link name="rod_C1"/></model></model>'
    path.write_text(path.read_text(encoding="utf-8").replace("</model>", beside), encoding="utf-8")
    again = models.load_robot(str(path))
    assert len(again.cables) == 8
    assert "frame: " in again.assumptions


def rods_in_plant(add, step=1e-3):
    plant = MultibodyPlant(step)
    add(plant)
    plant.Finalize()
    return plant


def test_drake_moves_the_chains_as_the_robot_with_rods(tmp_path):
    robot = models.load_robot("acrobot_large")
    path = written(robot, "sdf-drake", tmp_path)
    masses = np.full(len(robot.cables), 1e-3)
    ours = rods_in_plant(lambda plant: models.add_ups_robot(plant, robot, masses))
    theirs = rods_in_plant(lambda plant: Parser(plant).AddModels(str(path)))
    assert theirs.num_constraints() == len(robot.cables)
    poses = []
    for plant in (ours, theirs):
        simulator = Simulator(plant)
        context = simulator.get_mutable_context()
        tensions = -np.linspace(2.0, 9.0, len(robot.cables))
        names = [
            plant.get_joint_actuator(k).joint().name() for k in plant.GetJointActuatorIndices()
        ]
        order = [next(i for i, n in enumerate(names) if n.endswith(c.name)) for c in robot.cables]
        actuation = np.zeros(len(names))
        actuation[order] = tensions
        plant.get_actuation_input_port().FixValue(context, actuation)
        simulator.AdvanceTo(0.05)
        body = plant.GetBodyByName("platform")
        poses.append(plant.EvalBodyPoseInWorld(context, body).GetAsMatrix4())
    moved = np.max(np.abs(poses[0] - robot.home.transform().GetAsMatrix4()))
    assert moved > 1e-3
    np.testing.assert_allclose(poses[1], poses[0], atol=SAME_MOTION)


def test_formats_that_cannot_hold_a_robot_say_so():
    robot = models.load_robot("planar")
    with pytest.raises(RobotFileError, match="accepted for sdf: 3R3T"):
        models.export_robot(robot, "sdf")
    with pytest.raises(RobotFileError, match="accepted: sdf, sdf-drake"):
        models.export_robot(robot, "docx")


@pytest.fixture
def cdpr(tmp_path, capsys, monkeypatch):
    """Runs the command in the test's folder: exit code, stdout, stderr."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        with pytest.raises(SystemExit) as ended:
            main(list(arguments))
        return ended.value.code, *printed(capsys)

    return run


def test_command_line(cdpr, tmp_path):
    code, _, err = cdpr("export", "acrobot_large", "--format", "caspr", "--out", "there")
    assert code == 0, err
    assert (tmp_path / "there" / "acrobot_large_cables.xml").is_file()
    code, out, err = cdpr("import", "there", "--out", "mine", "--name", "mine", "--json")
    assert code == 0, err
    facts = json.loads(out)
    assert facts["cables"] == 8
    assert facts["format"] == "CASPR XML"
    assert "cable.youngs_modulus" in facts["assumed"]
    kept = (tmp_path / "mine" / "robot.yaml").read_text()
    code, _, err = cdpr("import", "there", "--out", "mine")
    assert code == 2
    assert "--overwrite" in err
    assert (tmp_path / "mine" / "robot.yaml").read_text() == kept
    assert sorted(p.name for p in (tmp_path / "mine").iterdir()) == ["README.md", "robot.yaml"]
