"""The compiled engine goes the way of the plant; cables between bodies go that of one platform."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.cables.route_kernel import make_route_room
from cdpr_drake.dynamics.tree_step_kernel import DONE, TreeMemory, tree_rates
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_routes import CableRoute, CableRoutes
from cdpr_drake.models.plant_bodies import body_inertias, joint_damping, rotor_inertias, whole_tree
from cdpr_drake.models.plant_rest import moved
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import PlatformDamping
from cdpr_drake.systems.robots.assembly import add_cable_robot
from cdpr_drake.systems.robots.compiled_mechanism import CompiledMechanism
from cdpr_drake.systems.robots.route_assembly import add_cables
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings
from tests.mechanisms.machines import MACHINES, STANDING, add_body, add_hinge
from tests.mechanisms.mechanism_cases import Cabled, advance, alone, machine

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
