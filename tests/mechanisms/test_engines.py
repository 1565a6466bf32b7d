"""Other engines: MuJoCo moves machines as Drake does, compiled ones go the way of the plant."""

from dataclasses import replace
from functools import cache

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
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.cables.route_kernel import make_route_room
from cdpr_drake.dynamics.tree_step_kernel import DONE, TreeMemory, tree_rates
from cdpr_drake.formats.plant_mjcf import export_plant_mjcf
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_routes import CableRoute, CableRoutes
from cdpr_drake.models.plant_bodies import body_inertias, joint_damping, rotor_inertias, whole_tree
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import moved
from cdpr_drake.models.platform_schema import PlatformDamping
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.assembly import add_cable_robot
from cdpr_drake.systems.robots.compiled_mechanism import CompiledMechanism
from cdpr_drake.systems.robots.route_assembly import add_cables
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings
from tests.mechanisms.machines import MACHINES, STANDING, Y, add_body, add_hinge, frame_of
from tests.mechanisms.mechanism_cases import (
    METHODS,
    Cabled,
    advance,
    alone,
    machine,
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


# The compiled engine; cables between bodies go the way of those of one platform.

RATES = 1e-12  # of accelerations, share of the largest: sums over bodies round; found 2e-13
SAME_WAY = 1e-9  # after 0.25 s by the same method [m, rad]; found 1e-12
GRAVITY = np.array([0.0, 0.0, -9.81])


@pytest.mark.parametrize("name", MACHINES)
def test_rates_are_those_of_the_plant(name):
    cabled, random = Cabled(name, ends={"retardation": 0.01}), np.random.default_rng(3)
    plant, own, m = cabled.plant, cabled.plant_context, cabled.routes.count
    np.testing.assert_array_equal(plant.gravity_field().gravity_vector(), GRAVITY)
    tree = whole_tree(plant)
    packed = cabled.routes.packed(tree.rows)
    memory = TreeMemory(
        tree.table, body_inertias(plant, tree), GRAVITY, joint_damping(plant),
        rotor_inertias(plant), packed, make_route_room(packed[0], m, 0),
    )  # fmt: skip
    home, nv = cabled.positions(), plant.num_velocities()
    for _ in range(10):
        q = moved(plant, home, random.uniform(-0.3, 0.3, nv))
        state = np.concatenate([q, random.uniform(-1.0, 1.0, nv)])
        plant.SetPositionsAndVelocities(own, state)
        lengths = cabled.cables.lengths_and_jacobian(own)[0] * random.uniform(0.97, 1.03, m)
        speeds = random.uniform(-0.1, 0.1, m)
        cabled.set_lengths(lengths)
        cabled.set_speeds(speeds)
        expected, rates = plant.EvalTimeDerivatives(own).CopyToVector(), np.zeros(len(state))
        assert tree_rates(memory.table, True, state, lengths, speeds, np.zeros(nv), rates) == DONE
        size = np.max(np.abs(expected))
        np.testing.assert_allclose(rates, expected, rtol=0, atol=RATES * size)


def ways(plant, routes, blocks, diagram, model, state, lengths, speeds):
    """States and tensions after 0.25 s, by the compiled engine and by the plant."""
    block = CompiledMechanism(plant, routes, model, period=0.05, max_step=1e-3)
    own, context = block.CreateDefaultContext(), diagram.CreateDefaultContext()
    own.SetDiscreteState(0, state)
    own.SetDiscreteState(1, lengths)
    block.GetInputPort("cable_velocities").FixValue(own, speeds)
    there = plant.GetMyMutableContextFromRoot(context)
    winches = blocks.winches.GetMyMutableContextFromRoot(context)
    plant.SetPositionsAndVelocities(there, state)
    blocks.winches.set_unstrained_lengths(winches, lengths)
    blocks.GetInputPort("cable_velocities").FixValue(winches, speeds)
    if plant.num_actuators():
        plant.get_actuation_input_port().FixValue(there, np.zeros(plant.num_actuators()))
    advance(diagram, context, 0.25)
    compiled = Simulator(block, own)  # updates at 0, 0.05, ... 0.2 move it to 0.25
    compiled.AdvanceTo(0.25)
    forces = blocks.forces.GetMyContextFromRoot(context)
    return (
        [block.GetOutputPort(port).Eval(own) for port in ("plant_state", "tensions")],
        [plant.GetPositionsAndVelocities(there), blocks.GetOutputPort("tensions").Eval(forces)],
    )


@pytest.mark.parametrize(
    ("name", "model", "ends"),
    [(name, "kelvin_voigt", {"retardation": 0.01}) for name in STANDING]
    + [("two_platforms", "catenary", {"linear_weight": 0.1})],
)
def test_it_goes_the_way_of_the_plant(name, model, ends):
    builder, random = DiagramBuilder(), np.random.default_rng(4)
    it = machine(name, builder)
    plant, routes = it.plant, it.with_ends(**ends)
    blocks = add_cables(builder, plant, routes, CableSettings(model=model))
    state = plant.GetPositionsAndVelocities(it.home())
    state[plant.num_positions() :] = random.uniform(-0.1, 0.1, plant.num_velocities())
    lengths = 0.998 * blocks.cables().lengths_and_jacobian(it.home())[0]
    speeds = random.uniform(-0.02, 0.02, routes.count)
    parts = plant, routes, blocks, builder.Build(), model
    compiled, by_plant = ways(*parts, state, lengths, speeds)
    np.testing.assert_allclose(compiled[0], by_plant[0], rtol=0, atol=SAME_WAY)
    np.testing.assert_allclose(compiled[1], by_plant[1], rtol=0, atol=1e4 * SAME_WAY)


def test_damped_joints_and_rotors_count():
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    link = add_body(plant, "link", 1.0, (0.4, 0.05, 0.06), (0.2, 0.0, 0.0))
    joint = add_hinge(plant, "hinge", plant.world_body(), (0, 0, 0), link, [0, 1, 0], 0.3)
    joint.set_default_damping(0.7)
    actuator = plant.get_joint_actuator(plant.GetJointActuatorIndices()[0])
    actuator.set_default_rotor_inertia(2e-4)
    actuator.set_default_gear_ratio(30.0)
    plant.Finalize()
    assert rotor_inertias(plant)[0] == pytest.approx(0.18)
    assert joint_damping(plant)[0] == 0.7
    points = [(plant.world_body(), (0.5, 0, 0.5)), (link, (0.3, 0, 0.0))]
    routes = CableRoutes.of(plant, [CableRoute(points=points, stiffness=1e3)])
    blocks = add_cables(builder, plant, routes)
    length = blocks.cables().lengths_and_jacobian(plant.CreateDefaultContext())[0]
    parts = plant, routes, blocks, builder.Build(), "kelvin_voigt"
    compiled, by_plant = ways(*parts, np.array([0.3, 1.5]), length, [0.0])
    np.testing.assert_allclose(compiled[0], by_plant[0], rtol=0, atol=SAME_WAY)


def test_it_rests_where_it_hangs_and_motors_hold():
    block = CompiledMechanism(alone("acrobot_arm").plant, alone("acrobot_arm").routes)
    context = block.CreateDefaultContext()
    rest = block.hang(context, prestress=10.0, lower=1.0)
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(8))
    block.GetInputPort("joint_forces").FixValue(context, rest.held)
    simulator = Simulator(block, context)
    simulator.AdvanceTo(0.5)
    state = block.GetOutputPort("plant_state").Eval(simulator.get_context())
    np.testing.assert_allclose(state[: len(rest.positions)], rest.positions, rtol=0, atol=1e-9)


ROBOTS = (
    "acrobot_large", "caroca", "cogiro", "fast", "grab_three", "ipanema_1", "kntu_planar", "planar",
    "planar_point", "spider_camera",
)  # fmt: skip
"""In space and in planes, of bodies and points, with three to eight cables."""

MODELS = {
    "points": CableSettings(model="kelvin_voigt", pulleys=False),
    "pulleys": CableSettings(model="kelvin_voigt", pulleys=True),
    "sagging": CableSettings(model="catenary", pulleys=True),
}


@cache
def undamped(name):
    """A robot without damping of its platform, as cables between bodies have no robot's file."""
    robot = load_robot(name)
    robot.damping = PlatformDamping()
    return robot


def way_of(name, settings, as_routes):
    """States of plant and winches, and tensions, from a moving start, by either kind of block."""
    robot, builder = undamped(name), DiagramBuilder()
    # E S of 10 kN: at a step of 1 ms the integrator does not hold the cables of the files.
    settings = replace(settings, stiffness_ratio=1e4 / np.max(robot.stiffness()))
    plant = builder.AddNamedSystem("plant", MultibodyPlant(0.0))
    in_plant = add_robot(plant, robot)
    plant.Finalize()
    if as_routes:
        routes = CableRoutes.of_cable_set(robot.cable_set(), int(in_plant.body_index))
        block = add_cables(builder, plant, routes, settings)
        assert block.method == "joints"
    else:
        block = add_cable_robot(builder, in_plant, CableRobotSettings(cables=settings))
    builder.ExportInput(block.GetInputPort("cable_velocities"), "cable_velocities")
    diagram = builder.Build()
    context, m = diagram.CreateDefaultContext(), len(robot.cables)
    diagram.GetInputPort("cable_velocities").FixValue(context, 0.01 * np.sin(np.arange(m)))
    plant_context = plant.GetMyMutableContextFromRoot(context)
    in_plant.set_pose(plant_context, robot.home.transform())
    plant.SetVelocities(plant_context, 0.05 * np.cos(np.arange(plant.num_velocities())))
    lengths = cable_paths(robot.home.transform(), settings.cable_set(robot)).lengths
    winches = block.winches.GetMyMutableContextFromRoot(context)
    block.winches.hold(winches, lengths, np.zeros(m))
    states, tensions = [], []
    for time in (0.05, 0.1, 0.15, 0.2):
        advance(diagram, context, time)
        states.append(context.get_continuous_state_vector().CopyToVector())
        forces = diagram.GetSubsystemContext(block.forces, context)
        tensions.append(np.array(block.GetOutputPort("tensions").Eval(forces)))
    return np.array(states), np.array(tensions)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("name", ROBOTS)
def test_cables_between_bodies_move_one_platform_to_the_same_bits(name, model):
    states, tensions = way_of(name, MODELS[model], as_routes=True)
    expected = way_of(name, MODELS[model], as_routes=False)
    assert np.all(np.isfinite(expected[0]))
    np.testing.assert_array_equal(states, expected[0])
    np.testing.assert_array_equal(tensions, expected[1])
    assert np.max(tensions) > 0.1  # N
