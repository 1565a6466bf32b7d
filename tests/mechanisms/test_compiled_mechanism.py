"""The compiled engine for plants on cables against MultibodyPlant."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RevoluteSpring
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.cables.route_kernel import make_route_room
from cdpr_drake.dynamics.tree_step_kernel import DONE, TreeMemory, tree_rates
from cdpr_drake.errors import CableGeometryError, CableModelError
from cdpr_drake.geometry.cable_routes import CableRoute, CableRoutes
from cdpr_drake.models.plant_bodies import (
    body_inertias,
    joint_damping,
    rotor_inertias,
    whole_tree,
)
from cdpr_drake.models.plant_rest import moved
from cdpr_drake.systems.robots.compiled_mechanism import CompiledMechanism
from cdpr_drake.systems.robots.route_assembly import add_cables
from cdpr_drake.systems.robots.settings import CableSettings
from tests.mechanisms.machines import MACHINES, STANDING, add_body, add_hinge, machine

STATES = 10

RATES = 1e-12
"""Of accelerations, as a share of the largest: rounding of sums over bodies; found 2e-13."""

SAME_WAY = 1e-9
"""After a quarter of a second by the same method: rounding that the motion has stretched [m, rad];
found 1e-12."""


def wired(name, model="kelvin_voigt", **ends):
    """A machine with cables in a diagram, and its parts."""
    builder = DiagramBuilder()
    it = machine(name, builder)
    routes = it.with_ends(**ends)
    blocks = add_cables(builder, it.plant, routes, CableSettings(model=model))
    return it, routes, blocks, builder.Build()


@pytest.mark.parametrize("name", MACHINES)
def test_rates_are_those_of_the_plant(name):
    it, routes, blocks, diagram = wired(name, retardation=0.01)
    plant, random = it.plant, np.random.default_rng(3)
    tree = whole_tree(plant)
    packed = routes.packed(tree.rows)
    rotors, damping = rotor_inertias(plant), joint_damping(plant)
    memory = TreeMemory(
        tree.table, body_inertias(plant, tree), np.array([0.0, 0.0, -9.81]), damping, rotors,
        packed, make_route_room(packed[0], routes.count, 0),
    )  # fmt: skip
    context = diagram.CreateDefaultContext()
    own = plant.GetMyMutableContextFromRoot(context)
    winches = blocks.winches.GetMyMutableContextFromRoot(context)
    home, nv = plant.GetPositions(it.home()), plant.num_velocities()
    gravity = plant.gravity_field().gravity_vector()
    np.testing.assert_array_equal(gravity, [0.0, 0.0, -9.81])
    for _ in range(STATES):
        state = np.concatenate(
            [moved(plant, home, random.uniform(-0.3, 0.3, nv)), random.uniform(-1.0, 1.0, nv)]
        )
        plant.SetPositionsAndVelocities(own, state)
        lengths = blocks.cables().lengths_and_jacobian(own)[0]
        lengths *= random.uniform(0.97, 1.03, routes.count)
        rates = random.uniform(-0.1, 0.1, routes.count)
        blocks.winches.set_unstrained_lengths(winches, lengths)
        blocks.GetInputPort("cable_velocities").FixValue(winches, rates)
        wanted = plant.EvalTimeDerivatives(own).CopyToVector()
        found = np.zeros(len(state))
        code = tree_rates(memory.table, True, state, lengths, rates, np.zeros(nv), found)
        assert code == DONE
        np.testing.assert_allclose(found, wanted, rtol=0, atol=RATES * np.max(np.abs(wanted)))


@pytest.mark.parametrize(
    ("name", "model", "ends"),
    [(name, "kelvin_voigt", {"retardation": 0.01}) for name in STANDING]
    + [("two_platforms", "catenary", {"linear_weight": 0.1})],
)
def test_it_goes_the_way_of_the_plant(name, model, ends):
    it, routes, blocks, diagram = wired(name, model, **ends)
    random, duration = np.random.default_rng(4), 0.25
    block = CompiledMechanism(it.plant, routes, model, period=0.05, max_step=1e-3)
    context, own = diagram.CreateDefaultContext(), block.CreateDefaultContext()
    plant = it.plant.GetMyMutableContextFromRoot(context)
    winches = blocks.winches.GetMyMutableContextFromRoot(context)
    state = it.plant.GetPositionsAndVelocities(it.home())
    state[it.plant.num_positions() :] = random.uniform(-0.1, 0.1, it.plant.num_velocities())
    lengths = 0.998 * blocks.cables().lengths_and_jacobian(it.home())[0]
    speeds = random.uniform(-0.02, 0.02, routes.count)
    it.plant.SetPositionsAndVelocities(plant, state)
    blocks.winches.set_unstrained_lengths(winches, lengths)
    blocks.GetInputPort("cable_velocities").FixValue(winches, speeds)
    own.SetDiscreteState(0, state)
    own.SetDiscreteState(1, lengths)
    block.GetInputPort("cable_velocities").FixValue(own, speeds)
    simulator = Simulator(diagram, context)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    simulator.AdvanceTo(duration)
    compiled = Simulator(block, own)
    compiled.AdvanceTo(duration)
    own = compiled.get_context()
    wanted = it.plant.GetPositionsAndVelocities(it.plant.GetMyContextFromRoot(context))
    # Periodic updates at 0, 0.05, ... 0.2 have moved it to 0.25.
    found = block.GetOutputPort("plant_state").Eval(own)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=SAME_WAY)
    pulls = blocks.GetOutputPort("tensions").Eval(blocks.forces.GetMyContextFromRoot(context))
    np.testing.assert_allclose(
        block.GetOutputPort("tensions").Eval(own), pulls, rtol=0, atol=1e4 * SAME_WAY
    )


def test_it_rests_where_it_hangs_and_motors_hold():
    it = machine("acrobot_arm")
    block = CompiledMechanism(it.plant, it.routes)
    context = block.CreateDefaultContext()
    rest = block.hang(context, prestress=10.0, lower=1.0)
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(8))
    block.GetInputPort("joint_forces").FixValue(context, rest.held)
    simulator = Simulator(block, context)
    simulator.AdvanceTo(0.5)
    state = block.GetOutputPort("plant_state").Eval(simulator.get_context())
    np.testing.assert_allclose(state[: len(rest.positions)], rest.positions, rtol=0, atol=1e-9)


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
    routes = CableRoutes.of(
        plant,
        [
            CableRoute(
                points=[(plant.world_body(), (0.5, 0, 0.5)), (link, (0.3, 0, 0.0))], stiffness=1e3
            )
        ],
    )
    block = CompiledMechanism(plant, routes)
    own = block.CreateDefaultContext()
    state = np.array([0.3, 1.5])
    own.SetDiscreteState(0, state)
    block.GetInputPort("cable_velocities").FixValue(own, [0.0])
    blocks = add_cables(builder, plant, routes)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant.SetPositionsAndVelocities(plant.GetMyMutableContextFromRoot(context), state)
    blocks.GetInputPort("cable_velocities").FixValue(
        blocks.winches.GetMyMutableContextFromRoot(context), [0.0]
    )
    simulator = Simulator(diagram, context)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    simulator.AdvanceTo(0.2)
    compiled = Simulator(block, own)
    compiled.AdvanceTo(0.2)
    np.testing.assert_allclose(
        block.GetOutputPort("plant_state").Eval(compiled.get_context()),
        plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(context)),
        rtol=0,
        atol=SAME_WAY,
    )


def _sprung():
    plant = MultibodyPlant(0.0)
    link = add_body(plant, "link", 1.0, (0.4, 0.05, 0.06), (0.2, 0.0, 0.0))
    joint = add_hinge(plant, "hinge", plant.world_body(), (0, 0, 0), link, [0, 1, 0], 0.3)
    plant.AddForceElement(RevoluteSpring(joint, 0.0, 1.0))
    plant.Finalize()
    return plant


@pytest.mark.parametrize(
    ("plant", "words"),
    [
        (_sprung, "force elements: found 1 beside gravity, such as springs"),
        (lambda: machine("planar_arm", time_step=1e-3).plant, "time_step: found 0.001 s"),
    ],
)
def test_what_the_compiled_engine_does_not_know_is_refused(plant, words):
    with pytest.raises(CableModelError, match=words):
        whole_tree(plant())


def test_a_step_that_is_too_long_is_said():
    it = machine("two_platforms")
    stiff = it.with_ends(stiffness=1e7)
    block = CompiledMechanism(it.plant, stiff, period=0.1, max_step=0.02)
    context = block.CreateDefaultContext()
    block.GetInputPort("cable_velocities").FixValue(context, np.full(stiff.count, -0.1))
    simulator = Simulator(block, context)
    with pytest.raises(CableGeometryError, match=r"steps shorter than 0\.02 s"):
        simulator.AdvanceTo(2.0)
