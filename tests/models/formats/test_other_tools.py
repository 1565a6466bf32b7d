"""What MuJoCo, Drake, CASPR's formula and firmwares say of exports: rest, lengths, motors."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import LoadModelDirectivesFromString, Parser, ProcessModelDirectives
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake import models
from cdpr_drake.errors import InfeasibleTensionError, RobotFileError
from cdpr_drake.formats.robot_exchange import export_robot
from cdpr_drake.formats.robot_exports import export_omissions
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_in_plant import add_robot, find_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.assembly import add_cable_robot
from tests.models.formats.foreign_files import REPRAP, saved
from tests.models.formats.unusual_robots import ALL, exported, made, written

EXACT = 1e-12
"""Text has all digits; rotations round a few times."""

AT_REST = 1e-6
"""Accelerations at rest [m/s^2, rad/s^2]; found: at most 6e-9, by rounding of tensions."""

SAME_MOTION = 1e-9
"""Two plants of the same bodies: constraints are solved to rounding, inertia and pose have 17
digits and are turned through angles [m, rad]."""

SMALL = "acrobot_small"


def at_home(name):
    """MuJoCo's model and data, nothing commanded."""
    mujoco = pytest.importorskip("mujoco")
    (text,) = exported(name, "mjcf").values()
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return mujoco, model, data


@pytest.mark.parametrize("name", [name for name in ALL if name != "beam"])
def test_it_is_at_rest_at_home_and_motors_add_nothing(name):
    """Wherever statics holds it."""
    robot, (_, _, data) = made(name), at_home(name)
    assert np.all(data.actuator_force == 0.0)
    cables, X_WP = robot.cable_set().without_pulleys(), robot.home.transform()
    why = ""
    try:
        hold_robot(robot, X_WP, cables, "elastic")
    except InfeasibleTensionError as problem:
        why = f"is no pose of rest, since {problem}"
    assert export_omissions(robot, "mjcf").get("home", "") == why
    assert (np.max(np.abs(data.qacc)) < AT_REST) == (why == "")


@pytest.mark.parametrize("name", ["cogiro", "caroca_gazebo", "everything", "flat"])
def test_motors_pull_up_to_the_largest_tension_and_never_push(name):
    mujoco, model, data = at_home(name)
    for command, force in ((1e9, 0.0), (-1e9, -made(name).tension_bounds.upper)):
        data.ctrl[:] = command
        mujoco.mj_forward(model, data)
        np.testing.assert_array_equal(data.actuator_force, force)


def test_statics_holds_most_robots_of_the_package():
    names = models.robot_names()
    assert sum("home" not in export_omissions(made(name), "mjcf") for name in names) >= 21


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
def test_caspr_has_cables_as_long_over_its_pulleys(name):
    robot = made(name)
    cables = ET.fromstring(exported(name, "caspr")[f"{name}_cables.xml"].partition("?>")[2])
    X_WP, found = robot.home.transform(), []
    for cable in cables.iter("cable_ideal"):
        pulley, anchor = cable.find("attachments")
        keys = ("fixed_location", "cable_entry_vector")
        point, to = (np.array(pulley.findtext(key).split(), float) for key in keys)
        p_WB = X_WP.multiply(np.array(anchor.findtext("location").split(), float))
        radius = float(pulley.findtext("pulley_radius"))
        found.append(length_over_caspr_pulley(point, to, p_WB, radius))
    np.testing.assert_allclose(found, cable_paths(X_WP, robot.cable_set()).lengths, atol=EXACT)


@pytest.mark.parametrize("format", ["sdf", "sdf-drake"])
def test_sdformat_finds_no_error(format, tmp_path):
    """By its library, which Drake's parser calls; here all that it warns of is an error."""
    path = written(exported("caroca", format), tmp_path)

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


@pytest.mark.parametrize("format", ["urdf", "drake", "sdf-drake"])
def test_drake_reads_exports_without_a_warning(format, tmp_path, caplog):
    written(exported(SMALL, format), tmp_path)
    first = next(path for path in tmp_path.iterdir() if path.suffix in (".urdf", ".sdf"))
    plant = MultibodyPlant(0.0)
    with caplog.at_level("WARNING"):
        Parser(plant).AddModels(str(first))
    assert caplog.messages == []


def pulled(add):
    """Where a platform on rods is after 0.05 s of tensions that differ."""
    plant = MultibodyPlant(1e-3)
    add(plant)
    plant.Finalize()
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    joints = [plant.get_joint_actuator(k).joint() for k in plant.GetJointActuatorIndices()]
    actuation = np.zeros(len(joints))
    for k, tension in enumerate(np.linspace(2.0, 9.0, 8), start=1):
        (place,) = [i for i, joint in enumerate(joints) if joint.name().endswith(f"C{k}")]
        actuation[place] = -tension
    plant.get_actuation_input_port().FixValue(context, actuation)
    simulator.AdvanceTo(0.05)
    pose = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("platform"))
    return plant.num_constraints(), pose.GetAsMatrix4()


def test_drake_moves_the_chains_as_the_robot_with_rods(tmp_path):
    robot = made("acrobot_large")
    path = written(exported("acrobot_large", "sdf-drake"), tmp_path)
    _, ours = pulled(lambda plant: models.add_ups_robot(plant, robot, np.full(8, 1e-3)))
    constraints, theirs = pulled(lambda plant: Parser(plant).AddModels(str(path)))
    assert constraints == 8
    assert np.max(np.abs(ours - robot.home.transform().GetAsMatrix4())) > 1e-3
    np.testing.assert_allclose(theirs, ours, atol=SAME_MOTION)


def packed(plant, folder):
    """A finalized plant with the exported package, by a directive of somebody's own."""
    written(exported(SMALL, "drake"), folder)
    parser = Parser(plant)
    parser.package_map().AddPackageXml(str(folder / "package.xml"))
    uri = f"package://{SMALL}/{SMALL}.dmd.yaml"
    text = f"directives:\n- add_directives: {{file: '{uri}'}}\n"
    ProcessModelDirectives(LoadModelDirectivesFromString(text), plant, parser)
    plant.mutable_gravity_field().set_gravity_vector(made(SMALL).gravity_vector())
    plant.Finalize()
    return plant


def rates(put):
    """Of the state in which the platform has left its home pose with a velocity."""
    robot, builder = made(SMALL), DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    in_plant = put(plant, robot)
    blocks = add_cable_robot(builder, in_plant)
    context = builder.Build().CreateDefaultContext()
    own, home = plant.GetMyMutableContextFromRoot(context), robot.home.transform()
    found = in_plant.pose(own).GetAsMatrix4()
    np.testing.assert_allclose(found, home.GetAsMatrix4(), rtol=0, atol=SAME_MOTION)
    blocks.set_at_equilibrium(context, home)
    away = home.translation() + np.array([0.01, 0.02, -0.03])
    in_plant.set_pose(own, RigidTransform(home.rotation(), away))
    plant.SetVelocities(own, in_plant.model_instance, [0.1, 0.2, -0.3, 0.05, -0.1, 0.02])
    winches = blocks.winches.GetMyMutableContextFromRoot(context)
    blocks.GetInputPort("cable_velocities").FixValue(winches, np.zeros(len(robot.cables)))
    acceleration = plant.get_generalized_acceleration_output_port(in_plant.model_instance)
    return acceleration.Eval(own)


def test_a_robot_that_directives_added_moves_as_one_of_ours(tmp_path):
    def ours(plant, robot):
        in_plant = add_robot(plant, robot)
        plant.Finalize()
        return in_plant

    theirs = rates(lambda plant, robot: find_robot(packed(plant, tmp_path), robot))
    size = np.max(np.abs(theirs))
    assert size > 10.0
    np.testing.assert_allclose(theirs, rates(ours), rtol=0, atol=SAME_MOTION * size)


def test_what_is_no_such_robot_is_said(tmp_path):
    plant, other = packed(MultibodyPlant(0.0), tmp_path), made("caroca")
    with pytest.raises(RobotFileError, match="found no model instance caroca"):
        find_robot(plant, other)
    with pytest.raises(RobotFileError, match="found a platform of"):
        find_robot(plant, other, SMALL)
    with pytest.raises(RobotFileError, match="accepted by find_robot: 3R3T"):
        find_robot(plant, made("planar"), SMALL)
    text = (tmp_path / f"{SMALL}.urdf").read_text(encoding="utf-8")
    standing = '<joint name="frame_to_world" type="fixed">'
    assert standing in text
    loose = MultibodyPlant(0.0)
    text = text.replace(standing, standing[:-1] + ' drake_ignore="true">')
    Parser(loose).AddModelsFromString(text, "urdf")
    loose.Finalize()
    with pytest.raises(RobotFileError, match="found 12 velocities"):
        find_robot(loose, made(SMALL))


def test_an_exported_urdf_is_one_tree_with_a_free_platform_at_home(tmp_path):
    """ROS' parser takes one root link; Drake and MuJoCo take the platform for a free body."""
    mujoco = pytest.importorskip("mujoco")
    robot = load_robot("acrobot_large")
    robot.home.angles_deg = np.array([4.0, -3.0, 8.0])
    path = written(export_robot(robot, "urdf"), tmp_path)
    tree = ET.fromstring(path.read_text(encoding="utf-8").partition("?>")[2])
    ends = [(joint.find("child"), joint.find("parent")) for joint in tree.iter("joint")]
    parents = {child.get("link"): parent.get("link") for child, parent in ends}
    links = {link.get("name") for link in tree.iter("link")}
    assert links - set(parents) == {"world"}
    assert set(parents.values()) <= links
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(path))
    plant.Finalize()
    assert plant.num_positions() == 7
    assert plant.GetBodyByName("platform").is_floating_base_body()
    context = plant.CreateDefaultContext()
    exit_1 = plant.GetBodyByName("exit_C1").EvalPoseInWorld(context).translation()
    np.testing.assert_allclose(exit_1, robot.exit_points()[:, 0], atol=SAME_MOTION)
    model, X_WP = mujoco.MjModel.from_xml_path(str(path)), robot.home.transform()
    q = X_WP.rotation().ToQuaternion().wxyz()
    np.testing.assert_allclose(model.qpos0, [*X_WP.translation(), *q], atol=SAME_MOTION)
    assert model.body("platform").mass == pytest.approx(robot.platform.mass)


# Machines as firmwares of printers and routers know them, by the laws of these firmwares.

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
    np.testing.assert_allclose(robot.stiffness(), 20000.0)
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
