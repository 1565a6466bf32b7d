"""What a file of MuJoCo holds of a plant beside joints and cables, and what it leaves out."""

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
from tests.mechanisms.cabled import alone, taut_lengths
from tests.mechanisms.machines import add_body, frame_of

ACCELERATION = 1e-10
"""As a share of the largest [-]; found 6e-15."""

Y = np.array([0.0, 1.0, 0.0])


def routes_to(plant, body):
    exit_point = (plant.world_body(), (1.0, 0.5, 2.0))
    return CableRoutes.of(
        plant, [CableRoute(points=[exit_point, (body, (0.1, 0.0, 0.05))], stiffness=1e3)]
    )


def compared(plant, body, forces=None):
    """Accelerations by Drake and by MuJoCo at a random state, in MuJoCo's coordinates."""
    cables = PlantCables(plant, routes_to(plant, body))
    context, nv = plant.CreateDefaultContext(), plant.num_velocities()
    random = np.random.default_rng(3)
    q = moved(plant, plant.GetPositions(context), random.uniform(-0.3, 0.3, nv))
    v = random.uniform(-1.0, 1.0, nv)
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    lengths, _ = cables.lengths_and_jacobian(context)
    l0 = 0.95 * lengths
    plant.get_applied_generalized_force_input_port().FixValue(
        context, cables.generalized_force(context, l0)
    )
    if plant.num_actuators():
        plant.get_actuation_input_port().FixValue(context, forces)
    theirs = plant.get_generalized_acceleration_output_port().Eval(context)
    made = export_plant_mjcf(plant, cables.routes, l0)
    model = mujoco.MjModel.from_xml_string(made.text)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = made.positions(q), made.velocities(q, v)
    if forces is not None:
        data.ctrl[:] = forces
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(
        made.positions(made.plant_positions(data.qpos)), data.qpos, atol=1e-14
    )
    np.testing.assert_allclose(made.plant_velocities(data.qpos, data.qvel), v, atol=1e-14)
    return made.velocities(q, theirs), np.array(data.qacc), made


def differ(ours, theirs):
    assert np.max(np.abs(theirs)) > 1.0
    return np.max(np.abs(ours - theirs)) / np.max(np.abs(theirs))


def chain(plant, joint):
    """A body on a joint between frames that are turned, on a body that turns."""
    base = add_body(plant, "base", 2.0, (0.3, 0.2, 0.2), (0.0, 0.0, 0.1))
    plant.AddJoint(RevoluteJoint("turn", plant.world_frame(), base.body_frame(), Y))
    body = add_body(plant, "body", 1.0, (0.2, 0.3, 0.25), (0.02, 0.01, 0.0))
    F = frame_of(plant, base, "F", (0.1, 0.2, 0.3), (0.3, -0.2, 0.5))
    M = frame_of(plant, body, "M", (0.05, -0.1, 0.02), (-0.4, 0.1, 0.7))
    plant.AddJoint(joint(F, M))
    plant.Finalize()
    return body


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
    body = chain(plant, DAMPED[kind])
    ours, theirs, made = compared(plant, body)
    assert differ(ours, theirs) < ACCELERATION
    assert made.left_out == ()


@pytest.mark.parametrize("offset", [False, True])
def test_a_floating_body_in_frames_of_its_own(offset):
    """A free joint where its frame lies in the body's origin, else slides and a ball."""
    plant = MultibodyPlant(0.0)
    body = add_body(plant, "body", 1.0, (0.2, 0.3, 0.25), (0.02, 0.01, 0.0))
    F = frame_of(plant, plant.world_body(), "F", (0.1, 0.2, 0.3), (0.3, -0.2, 0.5))
    M = frame_of(plant, body, "M", (0.1, 0.0, 0.0) if offset else (0, 0, 0), (-0.4, 0.1, 0.7))
    plant.AddJoint(QuaternionFloatingJoint("float", F, M))
    plant.Finalize()
    ours, theirs, made = compared(plant, body)
    assert differ(ours, theirs) < ACCELERATION
    assert ("<freejoint" in made.text) is not offset


def test_springs_motors_and_their_inertia():
    plant = MultibodyPlant(0.0)
    base = add_body(plant, "base", 2.0, (0.3, 0.2, 0.2), (0.0, 0.0, 0.1))
    turn = plant.AddJoint(RevoluteJoint("turn", plant.world_frame(), base.body_frame(), Y))
    body = add_body(plant, "body", 1.0, (0.2, 0.3, 0.25), (0.02, 0.01, 0.0))
    slide = plant.AddJoint(PrismaticJoint("slide", base.body_frame(), body.body_frame(), Y))
    for angle, stiffness in ((0.4, 30.0), (-0.1, 10.0)):
        plant.AddForceElement(RevoluteSpring(turn, angle, stiffness))
    plant.AddForceElement(PrismaticSpring(slide, 0.3, 50.0))
    for name, joint, inertia in (("m1", turn, 2e-4), ("m2", slide, 1e-4)):
        motor = plant.AddJointActuator(name, joint, 40.0)
        motor.set_default_rotor_inertia(inertia)
        motor.set_default_gear_ratio(50.0)
    turn.set_position_limits([-2.0], [2.0])
    plant.Finalize()
    ours, theirs, made = compared(plant, body, np.array([3.0, -20.0]))
    assert differ(ours, theirs) < ACCELERATION
    model = mujoco.MjModel.from_xml_string(made.text)
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
    ours, theirs, made = compared(plant, body)
    assert differ(ours, theirs) < ACCELERATION
    model = mujoco.MjModel.from_xml_string(made.text)
    assert [model.body(k).name for k in range(3)] == ["world", "one::body", "two::body"]


def test_a_plate_whose_moments_are_at_the_edge():
    """Its largest moment is the sum of the others, and MuJoCo wants no bit more."""
    for turn in np.linspace(0.1, 2.0, 12):
        plant = MultibodyPlant(0.0)
        plate = SpatialInertia.SolidBoxWithMass(1.0, 0.37, 0.21, 1e-12)
        R = RollPitchYaw(turn, 2.0 * turn, 0.3).ToRotationMatrix()
        body = plant.AddRigidBody("plate", plate.ReExpress(R))
        plant.Finalize()
        ours, theirs, _ = compared(plant, body)
        assert differ(ours, theirs) < ACCELERATION


def test_massless_links_are_taken_where_what_is_welded_to_them_has_mass():
    plant = MultibodyPlant(0.0)
    frame = plant.AddRigidBody("frame", SpatialInertia.Zero())
    body = add_body(plant, "body", 1.0, (0.2, 0.3, 0.25), (0.02, 0.01, 0.0))
    plant.AddJoint(RevoluteJoint("turn", plant.world_frame(), frame.body_frame(), Y))
    plant.WeldFrames(frame.body_frame(), body.body_frame(), RigidTransform([0.2, 0.0, 0.0]))
    plant.Finalize()
    ours, theirs, _ = compared(plant, body)
    assert differ(ours, theirs) < ACCELERATION


def test_home_is_a_keyframe():
    made = alone("human_arm")
    text = export_plant_mjcf(made.plant, made.routes, taut_lengths("human_arm")).text
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    mujoco.mj_forward(model, data)
    context = made.home()
    for name in ("upper_arm", "forearm"):
        X = made.plant.EvalBodyPoseInWorld(context, made.plant.GetBodyByName(name))
        np.testing.assert_allclose(data.body(name).xpos, X.translation(), atol=1e-14)


def test_what_is_left_out_is_named(tmp_path):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    body = add_body(plant, "body", 1.0, (0.2, 0.3, 0.25), (0.0, 0.0, 0.0))
    joint = plant.AddJoint(BallRpyJoint("ball", plant.world_frame(), body.body_frame()))
    joint.set_position_limits([-1.0] * 3, [1.0] * 3)
    plant.RegisterVisualGeometry(body, RigidTransform(), Box(0.2, 0.3, 0.25), "box", np.ones(4))
    plant.AddForceElement(
        LinearSpringDamper(plant.world_body(), np.zeros(3), body, Y, 1.0, 10.0, 0.0)
    )
    plant.Finalize()
    cable = CableRoute(
        points=[(plant.world_body(), (1.0, 0.0, 1.0)), (body, np.zeros(3))], stiffness=1e3,
        retardation=1e-3, linear_weight=0.1, breaking_load=1e3, pulley_radius=0.01,
        anchor_pulley_radius=0.01,
    )  # fmt: skip
    routes = CableRoutes.of(plant, [cable])
    made = export_plant_mjcf(plant, routes, np.array([1.0]), tmp_path / "a.xml")
    assert (tmp_path / "a.xml").read_text() == made.text
    mujoco.MjModel.from_xml_string(made.text)
    said = "\n".join(made.left_out)
    for words in (
        "limits of joint ball", "LinearSpringDamper", "pulleys at exit points",
        "pulleys at anchor points", "damping of the cables", "weight of the cables",
        "breaking loads", "shapes of the bodies",
    ):  # fmt: skip
        assert words in said
    assert len(made.left_out) == 8
