"""An independent engine: MuJoCo moves exported machines and joints as Drake does."""

import mujoco
import numpy as np
import pytest
from pydrake.geometry import Box
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import (
    BallRpyJoint,
    LinearSpringDamper,
    PlanarJoint,
    PrismaticJoint,
    PrismaticSpring,
    QuaternionFloatingJoint,
    RevoluteJoint,
    RevoluteSpring,
    SpatialInertia,
    UniversalJoint,
)
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.geometry.cable_routes import CableRoute, CableRoutes
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_mjcf import export_plant_mjcf
from cdpr_drake.models.plant_rest import moved
from tests.mechanisms.machines import MACHINES, Y, add_body, frame_of
from tests.mechanisms.mechanism_cases import (
    METHODS,
    Cabled,
    alone,
    random_states,
    taut_lengths,
)

STATES = 20
ACCELERATION, SHARE = 1e-8, 1e-12  # [m/s^2], and of those above 1e4; found 4e-10 at 2e4
JOINTS = 1e-10  # of accelerations of one body, share of the largest; found 6e-15


def in_mujoco(made, states, forces=()):
    """MuJoCo's model of an exported file, and its accelerations and lengths of cables at states.

    Coordinates go there and back.
    """
    model = mujoco.MjModel.from_xml_string(made.text)
    data, results = mujoco.MjData(model), []
    for q, v in states:
        data.qpos[:], data.qvel[:] = made.positions(q), made.velocities(q, v)
        data.ctrl[:] = forces
        mujoco.mj_forward(model, data)
        again = made.positions(made.plant_positions(data.qpos))
        np.testing.assert_allclose(again, data.qpos, atol=1e-14)
        np.testing.assert_allclose(made.plant_velocities(data.qpos, data.qvel), v, atol=1e-14)
        results.append((q, v, np.array(data.qacc), np.array(data.ten_length)))
    return model, results


@pytest.fixture(scope="module", params=MACHINES)
def machine_in_mujoco(request):
    """A machine at lengths with which a third to a half of the cables is slack."""
    name = request.param
    l0 = taut_lengths(name)
    l0 = l0 * (1.0 + 0.02 * np.sin(np.arange(1.0, len(l0) + 1.0)))
    made = export_plant_mjcf(alone(name).plant, alone(name).routes, l0)
    assert made.left_out == ()
    actuators = np.zeros(alone(name).plant.num_actuators())
    _, results = in_mujoco(made, random_states(name, STATES, seed=11), actuators)
    return name, l0, made, results


@pytest.mark.parametrize("method", METHODS)
def test_accelerations(machine_in_mujoco, method):
    name, l0, made, results = machine_in_mujoco
    cabled, slack = Cabled(name, method), []
    assert cabled.ports.method == method
    cabled.set_lengths(l0)
    for q, v, expected, _ in results:
        ours = made.velocities(q, cabled.accelerations(q, v))
        bound = max(ACCELERATION, SHARE * float(np.max(np.abs(expected))))
        np.testing.assert_allclose(ours, expected, rtol=0, atol=bound)
        slack.append(cabled.output("slack"))
    assert 0.1 < np.mean(slack) < 0.9  # both kinds are there


def exported(plant, body, forces=()):
    """The file of a plant with a cable to a body, after MuJoCo's accelerations are Drake's."""
    exit_point = (plant.world_body(), (1.0, 0.5, 2.0))
    cable = CableRoute(points=[exit_point, (body, (0.1, 0.0, 0.05))], stiffness=1e3)
    cables = PlantCables(plant, CableRoutes.of(plant, [cable]))
    context, nv = plant.CreateDefaultContext(), plant.num_velocities()
    random = np.random.default_rng(3)
    q = moved(plant, plant.GetPositions(context), random.uniform(-0.3, 0.3, nv))
    v = random.uniform(-1.0, 1.0, nv)
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    l0 = 0.95 * cables.lengths_and_jacobian(context)[0]
    pull = cables.generalized_force(context, l0)
    plant.get_applied_generalized_force_input_port().FixValue(context, pull)
    if plant.num_actuators():
        plant.get_actuation_input_port().FixValue(context, forces)
    expected = plant.get_generalized_acceleration_output_port().Eval(context)
    made = export_plant_mjcf(plant, cables.routes, l0)
    model, [(_, _, accelerations, _)] = in_mujoco(made, [(q, v)], forces)
    size = np.max(np.abs(accelerations))
    assert size > 1.0
    ours = made.velocities(q, expected)
    np.testing.assert_allclose(ours, accelerations, rtol=0, atol=JOINTS * size)
    return made, model


def box_on(plant, make, p_BM=(0.05, -0.1, 0.02), base=None):
    """A body on a joint between frames that are turned, on the world or on a base."""
    body = add_body(plant, "body", 1.0, (0.2, 0.3, 0.25), (0.02, 0.01, 0.0))
    F = frame_of(plant, base or plant.world_body(), "F", (0.1, 0.2, 0.3), (0.3, -0.2, 0.5))
    M = frame_of(plant, body, "M", p_BM, (-0.4, 0.1, 0.7))
    plant.AddJoint(make(F, M))
    return body


def turning_base(plant):
    base = add_body(plant, "base", 2.0, (0.3, 0.2, 0.2), (0.0, 0.0, 0.1))
    joint = plant.AddJoint(RevoluteJoint("turn", plant.world_frame(), base.body_frame(), Y))
    return base, joint


DAMPED = {
    "hinge": lambda F, M: RevoluteJoint("j", F, M, Y, 0.7),
    "slide": lambda F, M: PrismaticJoint("j", F, M, Y, damping=3.0),
    "plane": lambda F, M: PlanarJoint("j", F, M, np.array([1.0, 2.0, 0.3])),
    "ball": lambda F, M: BallRpyJoint("j", F, M, 0.4),
    "cross": lambda F, M: UniversalJoint("j", F, M, 0.4),
    "floating": lambda F, M: QuaternionFloatingJoint("j", F, M, 0.2, 1.5),
}


@pytest.mark.parametrize("kind", DAMPED)
def test_damping_of_joints(kind):
    plant = MultibodyPlant(0.0)
    body = box_on(plant, DAMPED[kind], base=turning_base(plant)[0])
    plant.Finalize()
    assert exported(plant, body)[0].left_out == ()


@pytest.mark.parametrize("offset", [False, True])
def test_a_floating_body_in_frames_of_its_own(offset):
    """A free joint where its frame lies in the body's origin, else slides and a ball."""
    plant, p_BM = MultibodyPlant(0.0), (0.1, 0.0, 0.0) if offset else (0.0, 0.0, 0.0)
    body = box_on(plant, lambda F, M: QuaternionFloatingJoint("float", F, M), p_BM)
    plant.Finalize()
    assert ("<freejoint" in exported(plant, body)[0].text) is not offset


def test_springs_motors_and_their_inertia():
    plant = MultibodyPlant(0.0)
    base, turn = turning_base(plant)
    body = add_body(plant, "body", 1.0, (0.2, 0.3, 0.25), (0.02, 0.01, 0.0))
    slide = plant.AddJoint(PrismaticJoint("slide", base.body_frame(), body.body_frame(), Y))
    plant.AddForceElement(RevoluteSpring(turn, 0.4, 30.0))
    plant.AddForceElement(RevoluteSpring(turn, -0.1, 10.0))
    plant.AddForceElement(PrismaticSpring(slide, 0.3, 50.0))
    for name, joint, inertia in (("m1", turn, 2e-4), ("m2", slide, 1e-4)):
        motor = plant.AddJointActuator(name, joint, 40.0)
        motor.set_default_rotor_inertia(inertia)
        motor.set_default_gear_ratio(50.0)
    turn.set_position_limits([-2.0], [2.0])
    plant.Finalize()
    _, model = exported(plant, body, [3.0, -20.0])
    np.testing.assert_array_equal(model.jnt_range[0], [-2.0, 2.0])
    np.testing.assert_array_equal(model.jnt_limited, [1, 0])
    np.testing.assert_array_equal(model.actuator_forcerange, [[-40.0, 40.0]] * 2)


def test_two_models_of_the_same_names_and_one_without_weight():
    plant = MultibodyPlant(0.0)
    for k, name in enumerate(("one", "two")):
        instance = plant.AddModelInstance(name)
        inertia = SpatialInertia.SolidBoxWithMass(1.0 + k, 0.3, 0.2, 0.1)
        body = plant.AddRigidBody("body", instance, inertia)
        plant.SetDefaultFloatingBaseBodyPose(body, RigidTransform([k, 0.2, 0.3]))
    plant.set_gravity_enabled(instance, False)
    plant.Finalize()
    _, model = exported(plant, body)
    assert [model.body(k).name for k in range(3)] == ["world", "one::body", "two::body"]


@pytest.mark.parametrize("turn", np.linspace(0.1, 2.0, 12))
def test_a_plate_whose_largest_moment_is_the_sum_of_the_others(turn):
    """MuJoCo wants no bit more."""
    plant, plate = MultibodyPlant(0.0), SpatialInertia.SolidBoxWithMass(1.0, 0.37, 0.21, 1e-12)
    R = RollPitchYaw(turn, 2.0 * turn, 0.3).ToRotationMatrix()
    body = plant.AddRigidBody("plate", plate.ReExpress(R))
    plant.Finalize()
    exported(plant, body)


def test_massless_links_are_taken_where_what_is_welded_to_them_has_mass():
    plant = MultibodyPlant(0.0)
    frame = plant.AddRigidBody("frame", SpatialInertia.Zero())
    body = add_body(plant, "body", 1.0, (0.2, 0.3, 0.25), (0.02, 0.01, 0.0))
    plant.AddJoint(RevoluteJoint("turn", plant.world_frame(), frame.body_frame(), Y))
    plant.WeldFrames(frame.body_frame(), body.body_frame(), RigidTransform([0.2, 0.0, 0.0]))
    plant.Finalize()
    exported(plant, body)


def test_home_is_a_keyframe():
    it = alone("human_arm")
    text = export_plant_mjcf(it.plant, it.routes, taut_lengths("human_arm")).text
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    mujoco.mj_forward(model, data)
    context = it.home()
    for name in ("upper_arm", "forearm"):
        X = it.plant.EvalBodyPoseInWorld(context, it.plant.GetBodyByName(name))
        np.testing.assert_allclose(data.body(name).xpos, X.translation(), atol=1e-14)


def test_what_is_left_out_is_named(tmp_path):
    plant, _ = AddMultibodyPlantSceneGraph(DiagramBuilder(), 0.0)
    world, body = plant.world_body(), add_body(plant, "body", 1.0, (0.2, 0.3, 0.25), (0, 0, 0))
    joint = plant.AddJoint(BallRpyJoint("ball", plant.world_frame(), body.body_frame()))
    joint.set_position_limits([-1.0] * 3, [1.0] * 3)
    plant.RegisterVisualGeometry(body, RigidTransform(), Box(0.2, 0.3, 0.25), "box", np.ones(4))
    plant.AddForceElement(LinearSpringDamper(world, np.zeros(3), body, Y, 1.0, 10.0, 0.0))
    plant.Finalize()
    cable = CableRoute(
        points=[(world, (1.0, 0.0, 1.0)), (body, np.zeros(3))], stiffness=1e3, retardation=1e-3,
        linear_weight=0.1, breaking_load=1e3, pulley_radius=0.01, anchor_pulley_radius=0.01,
    )  # fmt: skip
    routes, path = CableRoutes.of(plant, [cable]), tmp_path / "a.xml"
    made = export_plant_mjcf(plant, routes, np.array([1.0]), path)
    assert path.read_text() == made.text
    mujoco.MjModel.from_xml_string(made.text)
    assert len(made.left_out) == 8
    for words in (
        "limits of joint ball", "LinearSpringDamper", "pulleys at exit points",
        "pulleys at anchor points", "damping of the cables", "weight of the cables",
        "breaking loads", "shapes of the bodies",
    ):  # fmt: skip
        assert any(words in line for line in made.left_out), words
