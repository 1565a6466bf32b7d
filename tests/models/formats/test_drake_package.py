"""Robots as packages that model directives of Drake add, with cables beside them."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest
from pydrake.multibody.parsing import (
    LoadModelDirectivesFromString,
    Parser,
    ProcessModelDirectives,
)
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.robot_exchange import export_robot
from cdpr_drake.models.robot_in_plant import add_robot, find_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.assembly import add_cable_robot

ROBOT = "acrobot_small"

DECIMALS = 1e-9
"""How far motions may be apart [m, rad]: the file has inertia and pose in 17 digits, turned
through angles."""


def processed(plant, folder, robot):
    """Adds the exported package to a plant by a directive of somebody's own."""
    for name, text in export_robot(robot, "drake").items():
        (folder / name).write_text(text, encoding="utf-8")
    parser = Parser(plant)
    parser.package_map().AddPackageXml(str(folder / "package.xml"))
    uri = f"package://{robot.name}/{robot.name}.dmd.yaml"
    text = f"directives:\n- add_directives: {{file: '{uri}'}}\n"
    ProcessModelDirectives(LoadModelDirectivesFromString(text), plant, parser)
    plant.mutable_gravity_field().set_gravity_vector(robot.gravity_vector())


def moved(robot, put):
    """Where the platform is after a while that begins with a velocity."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    in_plant = put(plant)
    blocks = add_cable_robot(builder, in_plant)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    own = plant.GetMyMutableContextFromRoot(context)
    home = in_plant.pose(own)
    np.testing.assert_allclose(
        home.GetAsMatrix4(), robot.home.transform().GetAsMatrix4(), rtol=0, atol=DECIMALS
    )
    blocks.set_at_equilibrium(context, robot.home.transform())
    plant.SetVelocities(own, in_plant.model_instance, [0.1, 0.2, -0.3, 0.05, -0.1, 0.02])
    blocks.GetInputPort("cable_velocities").FixValue(
        blocks.winches.GetMyMutableContextFromRoot(context), np.zeros(len(robot.cables))
    )
    simulator = Simulator(diagram, context)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 2e-4)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    simulator.AdvanceTo(0.05)
    return in_plant.pose(own).GetAsMatrix4()


def test_a_robot_that_directives_added_moves_as_one_of_ours(tmp_path):
    robot = load_robot(ROBOT)

    def ours(plant):
        in_plant = add_robot(plant, robot)
        plant.Finalize()
        return in_plant

    def theirs(plant):
        processed(plant, tmp_path, robot)
        plant.Finalize()
        return find_robot(plant, robot)

    np.testing.assert_allclose(moved(robot, theirs), moved(robot, ours), rtol=0, atol=DECIMALS)


def test_what_is_no_such_robot_is_said(tmp_path):
    robot, other = load_robot(ROBOT), load_robot("caroca")
    plant = MultibodyPlant(0.0)
    processed(plant, tmp_path, robot)
    plant.Finalize()
    with pytest.raises(RobotFileError, match="found no model instance caroca"):
        find_robot(plant, other)
    with pytest.raises(RobotFileError, match="found a platform of"):
        find_robot(plant, other, ROBOT)
    with pytest.raises(RobotFileError, match="accepted by find_robot: 3R3T"):
        find_robot(plant, load_robot("planar"), ROBOT)
    loose = MultibodyPlant(0.0)
    text = (tmp_path / f"{ROBOT}.urdf").read_text(encoding="utf-8")
    standing = '<joint name="frame_to_world" type="fixed">'
    assert standing in text
    text = text.replace(standing, standing[:-1] + ' drake_ignore="true">')
    Parser(loose).AddModelsFromString(text, "urdf")
    loose.Finalize()
    with pytest.raises(RobotFileError, match="found 12 velocities"):
        find_robot(loose, robot)


@pytest.mark.parametrize("format", ["urdf", "drake", "sdf-drake"])
def test_drake_reads_exports_without_a_warning(format, tmp_path, caplog):
    for name, text in export_robot(load_robot(ROBOT), format).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    first = next(path for path in tmp_path.iterdir() if path.suffix in (".urdf", ".sdf"))
    plant = MultibodyPlant(0.0)
    with caplog.at_level("WARNING"):
        Parser(plant).AddModels(str(first))
    assert caplog.messages == []


def test_an_exported_urdf_is_one_tree_with_a_free_platform_at_home(tmp_path):
    """ROS' parser takes one root link; Drake and MuJoCo take the platform for a free body."""
    mujoco = pytest.importorskip("mujoco")
    robot = load_robot("acrobot_large")
    robot.home.angles_deg = np.array([4.0, -3.0, 8.0])
    X_WP = robot.home.transform()
    (text,) = export_robot(robot, "urdf").values()
    path = tmp_path / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    tree = ET.fromstring(text.partition("?>")[2])
    parents = {joint.find("child").get("link"): joint.find("parent").get("link")
               for joint in tree.iter("joint")}  # fmt: skip
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
    np.testing.assert_allclose(exit_1, robot.exit_points()[:, 0], atol=DECIMALS)
    model = mujoco.MjModel.from_xml_path(str(path))
    q = X_WP.rotation().ToQuaternion().wxyz()
    np.testing.assert_allclose(model.qpos0, [*X_WP.translation(), *q], atol=DECIMALS)
    assert model.body("platform").mass == pytest.approx(robot.platform.mass)
