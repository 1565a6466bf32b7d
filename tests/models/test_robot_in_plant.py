"""The platform in a MultibodyPlant: its inertia, its place among other bodies, its pose."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import SpatialInertia, default_model_instance
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.geometry.poses import pose_error, pose_from_angles, rotation_from_angles
from cdpr_drake.models.robot_in_plant import add_robot, platform_box, platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_forces import CableForces
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS

ROUND_OFF = 1e-12
"""Relative to quantities of order one: some hundred units of machine precision."""

SPATIAL_POSE = pose_from_angles(np.array([0.1, -0.2, 0.4]), np.array([0.3, -0.5, 2.0]))
PLANAR_POSE = pose_from_angles(np.array([0.1, -0.2, 0.3]), np.array([0.0, 0.0, -2.5]))


def plant_with(*robots):
    """A finalized plant with some robots, named robot0, robot1, ..."""
    plant = MultibodyPlant(0.0)
    handles = [add_robot(plant, robot, f"robot{i}") for i, robot in enumerate(robots)]
    plant.Finalize()
    return plant, handles


INERTIA = [0.02, 0.03, 0.04, 0.001, -0.002, 0.003]
FULL = np.array([[0.02, 0.001, -0.002], [0.001, 0.03, 0.003], [-0.002, 0.003, 0.04]])
OFF = np.array([0.01, -0.02, 0.03])


@pytest.mark.parametrize("p_PCo", [None, OFF])
@pytest.mark.parametrize("inertia", [None, INERTIA])
@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_inertia_is_that_of_the_file_or_of_a_solid_box_about_its_centre_of_mass(
    name, inertia, p_PCo
):
    """The box stands on Po, or goes along with the centre of mass; Steiner's theorem."""
    robot = load_robot(name)
    robot.platform.center_of_mass, robot.platform.inertia = p_PCo, inertia
    a, b, c = size = robot.platform.size
    mass, p = robot.platform.mass, np.array([0, 0, size[2] / 2]) if p_PCo is None else p_PCo
    box = mass / 12.0 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    about_com = box if inertia is None else FULL
    expected = about_com + mass * (p @ p * np.eye(3) - np.outer(p, p))
    M = platform_inertia(robot)
    assert M.get_mass() == mass
    np.testing.assert_allclose(M.get_com(), p, atol=ROUND_OFF)
    found = M.CalcRotationalInertia().CopyToFullMatrix3()
    np.testing.assert_allclose(found, expected, rtol=ROUND_OFF, atol=ROUND_OFF)
    X_PBox, shape = platform_box(robot)
    np.testing.assert_allclose(shape.size(), size)
    np.testing.assert_allclose(X_PBox.translation(), [0, 0, size[2] / 2], atol=ROUND_OFF)


def test_the_plant_has_the_robot_s_inertia_and_gravity():
    robot = load_robot("acrobot_small")
    robot.gravity = 1.62
    plant, (handle,) = plant_with(robot)
    context = plant.CreateDefaultContext()
    M = handle.body.CalcSpatialInertiaInBodyFrame(context)
    np.testing.assert_allclose(M.CopyToFullMatrix6(), platform_inertia(robot).CopyToFullMatrix6())
    np.testing.assert_array_equal(plant.gravity_field().gravity_vector(), [0.0, 0.0, -1.62])


def test_the_platform_is_shown_where_there_is_a_scene():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    handle = add_robot(plant, load_robot("planar"))
    plant.Finalize()
    (geometry,) = plant.GetVisualGeometriesForBody(handle.body)
    assert scene_graph.model_inspector().GetName(geometry) == "planar::platform"
    assert plant.GetCollisionGeometriesForBody(handle.body) == []


@pytest.mark.parametrize(
    ("name", "X_WP"), [("acrobot_small", SPATIAL_POSE), ("planar", PLANAR_POSE)]
)
def test_poses_of_two_robots_of_one_kind_come_back_at_rest(name, X_WP):
    robot = load_robot(name)
    plant, handles = plant_with(robot, robot)
    assert handles[0].model_instance != handles[1].model_instance
    context = plant.CreateDefaultContext()
    plant.SetVelocities(context, np.arange(1.0, plant.num_velocities() + 1.0))
    poses = [X_WP, RigidTransform([0.2, 0.0, X_WP.translation()[2]])]
    for handle, pose in zip(handles, poses, strict=True):
        handle.set_pose(context, pose)
    for handle, pose in zip(handles, poses, strict=True):
        assert max(pose_error(pose, handle.pose(context))) < ROUND_OFF
    np.testing.assert_array_equal(plant.GetVelocities(context), 0.0)


def test_the_same_name_twice_is_refused():
    plant = MultibodyPlant(0.0)
    robot = load_robot("acrobot_small")
    add_robot(plant, robot)
    with pytest.raises(RuntimeError, match="acrobot_small"):
        add_robot(plant, robot)


@pytest.mark.parametrize(("name", "size"), [("acrobot_small", 6), ("planar", 3)])
def test_forces_reach_only_the_platform_among_other_bodies(name, size):
    """A robot between two loose bodies: offsets, and the same force as in a plant of its own."""
    robot, ball, forces = load_robot(name), SpatialInertia.SolidSphereWithMass(1.0, 0.1), []
    turn = RigidTransform(rotation_from_angles([0.0, 0.0, 0.1]), [0.02, -0.01, 0.0])
    m, ones = len(robot.cables), np.arange(1.0, size + 1.0)
    for before, after in ((), ()), (("before",), ("after",)):
        plant = MultibodyPlant(0.0)
        for body in before:
            plant.AddRigidBody(body, default_model_instance(), ball)
        handle = add_robot(plant, robot)
        for body in after:
            plant.AddRigidBody(body, default_model_instance(), ball)
        plant.Finalize()
        context = plant.CreateDefaultContext()
        handle.set_pose(context, robot.home.transform() @ turn)
        cables = CableForces(handle)
        inputs = cables.CreateDefaultContext()
        state = plant.get_state_output_port(handle.model_instance).Eval(context)
        cables.GetInputPort("platform_state").FixValue(inputs, state)
        cables.GetInputPort("unstrained_lengths").FixValue(inputs, np.full(m, 0.5))
        cables.GetInputPort("unstrained_length_rates").FixValue(inputs, np.zeros(m))
        forces.append(cables.GetOutputPort("generalized_force").Eval(inputs))
    of_itself, among_others = forces
    assert np.count_nonzero(of_itself) == size
    start, expected, velocities = handle.first_velocity(), np.zeros(12 + size), np.zeros(12 + size)
    expected[start : start + size], velocities[start : start + size] = of_itself, ones
    np.testing.assert_array_equal(among_others, expected)
    plant.SetVelocities(context, handle.model_instance, ones)
    np.testing.assert_array_equal(plant.GetVelocities(context), velocities)


@pytest.mark.parametrize(
    ("gravity", "others", "warned"),
    [(-9.81, False, False), (-9.81, True, True), (-1.62, False, True), (-9.80665, True, False)],
)
def test_another_gravity_of_the_plant_is_not_changed_without_a_word(
    gravity, others, warned, caplog
):
    robot = load_robot("grab_four")
    assert robot.gravity == 9.80665
    plant = MultibodyPlant(0.0)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, gravity])
    if others:
        ball = SpatialInertia.SolidSphereWithMass(1.0, 0.1)
        plant.AddRigidBody("ball", default_model_instance(), ball)
    add_robot(plant, robot)
    np.testing.assert_array_equal(plant.gravity_field().gravity_vector(), robot.gravity_vector())
    told = [
        f"gravity of the whole plant: was (0, 0, {gravity:g}), is now that of grab_four, "
        "(0, 0, -9.80665) m/s^2"
    ]
    assert caplog.messages == (told if warned else [])
