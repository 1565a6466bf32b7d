"""Cables between bodies beside other blocks: discrete plants, contact, robots in one plant."""

import numpy as np
import pytest
from pydrake.common import RandomGenerator
from pydrake.geometry import Box, HalfSpace
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import ScrewJoint, SpatialInertia
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from cdpr_drake.geometry.cable_routes import CableRoute, CableRoutes
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import hang
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.assembly import add_cable_robot
from cdpr_drake.systems.robots.route_assembly import add_cables
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings
from tests.mechanisms.cabled import METHODS, Cabled
from tests.mechanisms.machines import machine

AT_REST = 1e-9
"""How far a machine moves in 0.1 s that starts at rest [m, rad]; found 3e-15."""

SAME = 1e-12
"""Share by which forces differ whose parts are added in another order; found 1e-16."""

DRIFT = 1e-4
"""By which a discrete plant of 1 ms is off a continuous one after 50 ms, from a push of 0.1 m/s
[m, rad]: its integrator is of first order. Found 1.3e-5, and 3e-6 at half
the step."""


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("time_step", [0.0, 1e-3], ids=["continuous", "discrete"])
@pytest.mark.parametrize("name", ["acrobot_arm", "two_platforms", "mobile_masts"])
def test_a_machine_at_rest_stays_there(name, method, time_step):
    """Motors hold what `hang` says that they must; bases would roll inward without."""
    cabled = Cabled(name, method, time_step=time_step, ends={"retardation": 1e-3})
    rest = cabled.ports.hang(cabled.context, lower=1.0, upper=60.0)
    if cabled.plant.num_actuators():
        assert np.max(np.abs(rest.held)) > 0.1
        cabled.set_motors(cabled.plant.MakeActuationMatrix().T @ rest.held)
    simulator = Simulator(cabled.diagram, cabled.context)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3).set_fixed_step_mode(True)
    simulator.AdvanceTo(0.1)
    q = cabled.plant.GetPositions(cabled.plant_context)
    assert np.max(np.abs(q - rest.positions)) < AT_REST


def pushed(time_step, method="joints"):
    cabled = Cabled("hanging_arm", method, time_step=time_step)
    rest = cabled.ports.hang(cabled.context, lower=1.0, upper=60.0)
    nv = cabled.plant.num_velocities()
    cabled.set_state(rest.positions, 0.1 * np.cos(np.arange(nv)))
    simulator = Simulator(cabled.diagram, cabled.context)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3).set_fixed_step_mode(True)
    simulator.AdvanceTo(0.05)
    return cabled.plant.GetPositions(cabled.plant_context)


@pytest.mark.parametrize("method", METHODS)
def test_a_discrete_plant_moves_as_a_continuous_one(method):
    exact, coarse, fine = (pushed(step, method) for step in (0.0, 1e-3, 0.5e-3))
    assert 0.0 < np.max(np.abs(coarse - exact)) < DRIFT
    assert np.max(np.abs(fine - exact)) < 0.7 * np.max(np.abs(coarse - exact))


@pytest.mark.parametrize("time_step", [0.0, 1e-3], ids=["continuous", "discrete"])
def test_a_box_is_let_down_on_the_ground(time_step):
    """Its cables go slack there, and the ground carries it."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step)
    plant.set_penetration_allowance(1e-4)
    box = plant.AddRigidBody("box", SpatialInertia.SolidBoxWithMass(2.0, 0.3, 0.3, 0.2))
    friction = CoulombFriction(0.8, 0.8)
    for body, shape in ((box, Box(0.3, 0.3, 0.2)), (plant.world_body(), HalfSpace())):
        plant.RegisterCollisionGeometry(body, RigidTransform(), shape, "shape", friction)
    plant.SetDefaultFloatingBaseBodyPose(box, RigidTransform([0.0, 0.0, 0.12]))
    plant.Finalize()
    routes = CableRoutes.of(
        plant,
        [
            CableRoute(
                points=[(plant.world_body(), (3 * x, 3 * y, 1.0)), (box, (x, y, 0.1))],
                stiffness=5e3, retardation=5e-3,
            )
            for x in (-0.15, 0.15) for y in (-0.15, 0.15)
        ],
    )  # fmt: skip
    ports = add_cables(builder, plant, routes)
    builder.ExportInput(ports.GetInputPort("cable_velocities"), "cable_velocities")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    ports.hang(context)
    diagram.GetInputPort("cable_velocities").FixValue(context, np.full(4, 0.1))
    simulator = Simulator(diagram, context)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 2e-4).set_fixed_step_mode(True)
    simulator.AdvanceTo(0.4)
    z = plant.GetPositions(plant.GetMyContextFromRoot(context))[6]
    assert abs(z - 0.1) < 1e-3
    slack = ports.GetOutputPort("slack").Eval(diagram.GetSubsystemContext(ports.forces, context))
    assert np.all(slack == 1.0)


def shared_plant(parts):
    """ACROBOT and a load below it in one plant, by add_cables or as a robot of its own."""
    robot, builder = load_robot("acrobot_large"), DiagramBuilder()
    plant = builder.AddNamedSystem("plant", MultibodyPlant(0.0))
    in_plant = add_robot(plant, robot)
    inertia = SpatialInertia.SolidBoxWithMass(0.5, 0.1, 0.1, 0.1)
    load = plant.AddRigidBody("load", plant.AddModelInstance("load"), inertia)
    plant.SetDefaultFloatingBaseBodyPose(load, RigidTransform([0.0, 0.0, -0.3]))
    plant.Finalize()
    routes = {
        "robot": CableRoutes.of_cable_set(robot.cable_set(), int(in_plant.body_index)),
        "load": CableRoutes.of(
            plant,
            [
                CableRoute(points=[(in_plant.body, (x, y, -0.035)), (load, (0.0, 0.0, 0.05))],
                           stiffness=5e3)
                for x, y in ((0.08, 0.0), (-0.08, 0.07), (-0.08, -0.07))
            ],
        ),
    }  # fmt: skip
    settings = CableSettings(pulleys=True, stiffness_ratio=0.03)
    blocks = []
    for k, (part, method) in enumerate(parts):
        if part == "robot" and method == "robot":
            made = add_cable_robot(
                builder, in_plant, CableRobotSettings(cables=settings), name=f"part_{k}"
            )
        else:
            made = add_cables(
                builder, plant, routes[part], settings, method=method, name=f"part_{k}"
            )
        m = routes[part].count
        builder.ExportInput(made.GetInputPort("cable_velocities"), f"velocities_{k}")
        blocks.append((made, m))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    for k, (made, m) in enumerate(blocks):
        diagram.GetInputPort(f"velocities_{k}").FixValue(context, np.zeros(m))
        at = diagram.GetSubsystemContext(made.forces, context)
        lengths = made.GetOutputPort("lengths").Eval(at)
        winches = made.winches.GetMyMutableContextFromRoot(context)
        made.winches.hold(winches, 0.99 * lengths, np.zeros(m))
    plant_context = plant.GetMyMutableContextFromRoot(context)
    plant.SetVelocities(plant_context, 0.1 * np.cos(np.arange(plant.num_velocities())))
    return plant, diagram, context


WAYS = {
    "robot, then cables": [("robot", "robot"), ("load", "joints")],
    "cables, then robot": [("load", "joints"), ("robot", "robot")],
    "twice cables": [("robot", "joints"), ("load", "joints")],
    "both on bodies": [("robot", "bodies"), ("load", "bodies")],
    "one on bodies": [("robot", "joints"), ("load", "bodies")],
}


def test_robots_and_cables_share_a_plant():
    """Whoever adds them, forces add up; and it runs."""
    found = []
    for parts in WAYS.values():
        plant, diagram, context = shared_plant(parts)
        port = plant.get_generalized_acceleration_output_port()
        found.append(np.array(port.Eval(plant.GetMyContextFromRoot(context))))
        simulator = Simulator(diagram, context)
        ResetIntegratorFromFlags(simulator, "runge_kutta3", 2e-4).set_fixed_step_mode(True)
        simulator.AdvanceTo(0.01)
    assert np.max(np.abs(found[0])) > 10.0
    for way, other in zip(WAYS, found, strict=True):
        assert np.max(np.abs(other - found[0])) < SAME * np.max(np.abs(found[0])), way


def screw(method, builder=None):
    """A nut on a screw that a cable turns, and what add_cables makes of it."""
    builder = builder or DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    nut = plant.AddRigidBody("nut", SpatialInertia.SolidBoxWithMass(1.0, 0.2, 0.2, 0.1))
    plant.AddJoint(ScrewJoint("thread", plant.world_frame(), nut.body_frame(), [0, 0, 1], 0.05, 0))
    plant.Finalize()
    routes = CableRoutes.of(
        plant,
        [CableRoute(points=[(plant.world_body(), (1.0, 0.5, 0.0)), (nut, (0.1, 0.0, 0.0))],
                    stiffness=1e3)],
    )  # fmt: skip
    return builder, plant, add_cables(builder, plant, routes, method=method)


def test_joints_that_are_not_compiled_take_forces_on_bodies_and_say_so():
    builder, plant, ports = screw("automatic")
    assert ports.method == "bodies"
    assert "joint thread: found a ScrewJoint" in ports.why
    builder.ExportInput(ports.GetInputPort("cable_velocities"), "cable_velocities")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    diagram.GetInputPort("cable_velocities").FixValue(context, np.zeros(1))
    winches = ports.winches.GetMyMutableContextFromRoot(context)
    ports.winches.hold(winches, [0.9], [0.0])
    plant_context = plant.GetMyContextFromRoot(context)
    force = ports.cables().generalized_force(plant_context, np.array([0.9]))
    assert abs(force[0]) > 1.0
    acceleration = plant.get_generalized_acceleration_output_port().Eval(plant_context)
    M = plant.CalcMassMatrix(plant_context)
    weight = plant.CalcGravityGeneralizedForces(plant_context)
    assert abs(M[0, 0] * acceleration[0] - force[0] - weight[0]) < SAME * abs(force[0])


def test_bodies_asked_for_need_no_reason():
    assert Cabled("hanging_arm", "bodies").ports.why == ""
    assert Cabled("hanging_arm", "automatic").ports.method == "joints"


@pytest.mark.parametrize("name", ["two_platforms", "acrobot_arm"])
def test_a_rest_that_is_given_is_that_of_default_and_random_contexts(name):
    it = machine(name)
    rest = hang(PlantCables(it.plant, it.routes), it.home(), lower=1.0, upper=60.0)
    builder = DiagramBuilder()
    it = machine(name, builder)
    ports = add_cables(builder, it.plant, it.routes, rest=rest)
    still = builder.AddSystem(ConstantVectorSource(np.zeros(it.routes.count)))
    builder.Connect(still.get_output_port(), ports.GetInputPort("cable_velocities"))
    if it.plant.num_actuators():
        torques = it.plant.MakeActuationMatrix().T @ rest.held
        motors = builder.AddSystem(ConstantVectorSource(torques))
        builder.Connect(motors.get_output_port(), it.plant.get_actuation_input_port())
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    diagram.SetRandomContext(context, RandomGenerator(2))
    Simulator(diagram, context).AdvanceTo(0.05)
    q = it.plant.GetPositions(it.plant.GetMyContextFromRoot(context))
    assert np.max(np.abs(q - rest.positions)) < 1e-7
