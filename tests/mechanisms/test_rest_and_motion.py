"""Where machines come to rest on given lengths, and how they stay and move in diagrams."""

import numpy as np
import pytest
from pydrake.common import RandomGenerator
from pydrake.geometry import Box, HalfSpace
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from scipy.optimize import minimize

from cdpr_drake.errors import InfeasibleTensionError
from cdpr_drake.geometry.cable_routes import CableRoute, CableRoutes
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import _Model, hang, moved, rows_of_motors, settle
from cdpr_drake.models.robot_in_plant import add_robot, carried_bodies
from cdpr_drake.systems.controllers.correction_laws import ConstantThreshold
from cdpr_drake.systems.controllers.tension_corrector import TensionCorrector
from cdpr_drake.systems.monitoring.tension_watch import BreakingLoadWatch
from cdpr_drake.systems.robots.assembly import add_cable_robot, apply_force
from cdpr_drake.systems.robots.motor_winch import MotorWinch
from cdpr_drake.systems.robots.route_assembly import add_cables
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings
from tests.mechanisms.machines import STANDING, STIFFNESS, shipped
from tests.mechanisms.mechanism_cases import (
    METHODS,
    Cabled,
    DrivenBases,
    advance,
    alone,
    cables_of,
    machine,
    random_states,
    rest_of,
    robot_with_arm,
    screw_plant,
)

ROUNDING = 1e-14  # forces left, share of E S: lengths of a metre round to 1e-16; found 4e-16
SAME = 1e-9  # how far two ways to one rest end apart [m, rad], and share of E S; found 2e-15
FIBRE = 348717.0  # E S of the 2 mm rope of ACROBOT [N], which slackens by micrometres


def check_stable(rest, stiffness=STIFFNESS):
    assert rest.stability == "stable"
    assert rest.residual < ROUNDING * stiffness


@pytest.mark.parametrize("stiffness", [STIFFNESS, FIBRE], ids=["soft", "fibre"])
@pytest.mark.parametrize("name", STANDING)
def test_it_ends_stable_from_random_starts_and_lengths(name, stiffness):
    """Lengths of 4 mm a metre off: with fibres a part of the cables is slack then."""
    cables, context = cables_of(name, stiffness=stiffness), alone(name).home()
    l0 = hang(cables, context, lower=1.0, upper=60.0).unstrained_lengths
    random = np.random.default_rng(51)
    for q, _ in random_states(name, 2, seed=52, spread=1.0):
        cables.plant.SetPositions(context, q)
        errors = 1.0 + random.uniform(-0.004, 0.004, len(l0))
        check_stable(settle(cables, context, l0 * errors), stiffness)


@pytest.mark.parametrize("name", STANDING)
def test_it_finds_what_hang_found(name):
    """From two millimetres beside it, with the lengths that hold it."""
    rest, context, cables = rest_of(name), alone(name).home(), cables_of(name)
    nv = cables.plant.num_velocities()
    step = np.where(rows_of_motors(cables.plant), 0.0, 2e-3 * np.cos(np.arange(nv)))
    cables.plant.SetPositions(context, moved(cables.plant, rest.positions, step))
    again = settle(cables, context, rest.unstrained_lengths)
    np.testing.assert_allclose(again.positions, rest.positions, rtol=0, atol=SAME)
    np.testing.assert_allclose(again.held, rest.held, rtol=0, atol=SAME * STIFFNESS)
    np.testing.assert_allclose(again.tensions, rest.tensions, rtol=0, atol=SAME * STIFFNESS)


@pytest.mark.parametrize("angle", [np.pi, 2.9])
def test_an_arm_that_stands_upright_comes_down(angle):
    """At pi it is at rest, but would not stay there."""
    cables, context = cables_of("hanging_arm"), alone("hanging_arm").home()
    plant, rest = cables.plant, rest_of("hanging_arm")
    start = np.array(rest.positions)
    start[plant.GetJointByName("shoulder").position_start()] = angle
    plant.SetPositions(context, start)
    upright = cables.energy(context, rest.unstrained_lengths)
    down = settle(cables, context, rest.unstrained_lengths)
    assert down.stability == "stable"
    plant.SetPositions(context, down.positions)
    assert cables.energy(context, rest.unstrained_lengths) < upright - 1.0


def test_a_cable_at_the_edge_of_slack_does_not_hide_the_rest():
    """Two cables that a tenth of a micrometre holds taut."""
    cables, context = cables_of("two_platforms", stiffness=FIBRE), alone("two_platforms").home()
    rest = hang(cables, context, lower=1.0, upper=100.0, prestress=np.full(16, 20.0))
    l0 = rest.unstrained_lengths.copy()
    l0[[0, 5]] = cables.outputs(context, l0)[2][[0, 5]] - 1e-7
    cables.plant.SetPositions(context, next(random_states("two_platforms", 1, seed=54))[0])
    check_stable(settle(cables, context, l0), FIBRE)


def test_what_nothing_resists_stays_where_it_is():
    """A body on one cable swings to below its exit point, however it is turned about the cable."""
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("body", SpatialInertia.SolidBoxWithMass(2.0, 0.3, 0.2, 0.1))
    plant.Finalize()
    points = [(plant.world_body(), (0.0, 0.0, 1.0)), (body, (0.0, 0.0, 0.05))]
    routes = CableRoutes.of(plant, [CableRoute(points=points, stiffness=STIFFNESS)])
    context, turned = plant.CreateDefaultContext(), RollPitchYaw(0.3, -0.2, 0.9)
    plant.SetFreeBodyPose(context, body, RigidTransform(turned, [0.2, 0.1, -0.1]))
    rest = settle(PlantCables(plant, routes), context, [1.0])
    assert rest.stability == "neutral"
    assert rest.residual < ROUNDING * STIFFNESS
    np.testing.assert_allclose(rest.positions[4:6], 0.0, atol=1e-6)  # below the exit point


def test_a_step_of_the_model_follows_cables_that_catch_and_let_go():
    """Least energy of springs that only pull, against a program that knows nothing of kinks."""
    random, changed = np.random.default_rng(56), 0
    for _ in range(20):
        B = random.normal(size=(4, 4))
        model = _Model(
            random.normal(scale=3.0, size=4), B @ B.T, random.normal(size=(7, 4)),
            random.uniform(5.0, 50.0, 7), random.uniform(-0.3, 0.3, 7),
        )  # fmt: skip

        def energy(d, model=model):
            pulled = np.maximum(model.stretch + model.J @ d, 0.0)
            stored = d @ model.smooth @ d + pulled @ (model.springs * pulled)
            return float(stored / 2.0 - model.others @ d)

        d, least = model.step(np.zeros((4, 4)))
        assert least
        oracle = minimize(energy, np.zeros(4), method="BFGS", options={"gtol": 1e-9})
        assert energy(d) < oracle.fun + 1e-9
        changed += not np.array_equal(model.stretch > 0.0, model.stretch + model.J @ d > 0.0)
    assert changed > 10


def test_cables_that_sag_settle_too():
    cables = cables_of("two_platforms", "catenary", linear_weight=0.03)
    context = alone("two_platforms").home()
    cables.plant.SetPositions(context, next(random_states("two_platforms", 1, seed=55))[0])
    check_stable(settle(cables, context, 1.001 * rest_of("two_platforms").unstrained_lengths))


def test_everything_held_needs_no_step():
    cables, context = cables_of("planar_arm"), alone("planar_arm").home()
    l0 = rest_of("planar_arm").unstrained_lengths
    rest = settle(cables, context, 0.99 * l0, held=["shoulder", "elbow"])
    np.testing.assert_array_equal(rest.positions, cables.plant.GetPositions(context))
    assert np.max(np.abs(rest.held)) > 1.0
    assert rest.stability == "stable"


# In diagrams.

AT_REST = 1e-9  # motion in 0.1 s from rest [m, rad]; found 3e-15
ORDER = 1e-12  # share by which forces differ that are added in another order; found 1e-16
steps = pytest.mark.parametrize("time_step", [0.0, 1e-3], ids=["continuous", "discrete"])


@pytest.mark.parametrize("method", METHODS)
@steps
@pytest.mark.parametrize("name", ["acrobot_arm", "two_platforms", "mobile_masts"])
def test_a_machine_at_rest_stays_there(name, method, time_step):
    """Motors hold what `hang` says that they must; bases would roll inward without."""
    cabled = Cabled(name, method, time_step=time_step, ends={"retardation": 1e-3})
    rest = cabled.ports.hang(cabled.context, lower=1.0, upper=60.0)
    cabled.set_motors(rest.held)
    assert not cabled.plant.num_actuators() or np.max(np.abs(rest.held)) > 0.1
    cabled.advance(0.1)
    np.testing.assert_allclose(cabled.positions(), rest.positions, rtol=0, atol=AT_REST)


@pytest.mark.parametrize("name", ["two_platforms", "acrobot_arm"])
def test_a_rest_that_is_given_is_that_of_default_and_random_contexts(name):
    builder, rest = DiagramBuilder(), rest_of(name)
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
    np.testing.assert_allclose(q, rest.positions, rtol=0, atol=1e-7)


def test_hang_holds_an_arm_on_a_robots_platform():
    plant, in_plant, blocks, diagram = robot_with_arm()
    assert carried_bodies(in_plant) == ("arm::arm",)
    context = diagram.CreateDefaultContext()
    own = plant.GetMyMutableContextFromRoot(context)
    plant.GetJointByName("shoulder").set_angle(own, 0.6)
    routes = CableRoutes.of_cable_set(blocks.forces.cable_set(), int(in_plant.body_index))
    rest = hang(PlantCables(plant, routes), own)
    assert rest.stability == "stable"
    plant.SetPositions(own, rest.positions)
    winches = blocks.winches.GetMyMutableContextFromRoot(context)
    blocks.winches.hold(winches, rest.unstrained_lengths, rest.tensions)
    blocks.GetInputPort("cable_velocities").FixValue(winches, np.zeros(8))
    advance(diagram, context, 0.5)
    np.testing.assert_allclose(plant.GetPositions(own), rest.positions, rtol=0, atol=AT_REST)


@steps
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
    corners = [(x, y) for x in (-0.15, 0.15) for y in (-0.15, 0.15)]
    points = [[(plant.world_body(), (3 * x, 3 * y, 1.0)), (box, (x, y, 0.1))] for x, y in corners]
    cables = [CableRoute(points=p, stiffness=5e3, retardation=5e-3) for p in points]
    ports = add_cables(builder, plant, CableRoutes.of(plant, cables))
    builder.ExportInput(ports.GetInputPort("cable_velocities"), "cable_velocities")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    ports.hang(context)
    diagram.GetInputPort("cable_velocities").FixValue(context, np.full(4, 0.1))
    advance(diagram, context, 0.4, 2e-4)
    assert abs(plant.GetPositions(plant.GetMyContextFromRoot(context))[6] - 0.1) < 1e-3
    slack = ports.GetOutputPort("slack").Eval(diagram.GetSubsystemContext(ports.forces, context))
    assert np.all(slack == 1.0)


WAYS = {
    "robot, then cables": [("robot", "robot"), ("load", "joints")],
    "cables, then robot": [("load", "joints"), ("robot", "robot")],
    "twice cables": [("robot", "joints"), ("load", "joints")],
    "both on bodies": [("robot", "bodies"), ("load", "bodies")],
    "one on bodies": [("robot", "joints"), ("load", "bodies")],
}


def accelerations_of_shared_plant(parts):
    """ACROBOT and a load below it in one plant, by add_cables or as a robot of its own."""
    robot, builder = shipped("acrobot_large"), DiagramBuilder()
    plant = builder.AddNamedSystem("plant", MultibodyPlant(0.0))
    in_plant = add_robot(plant, robot)
    inertia = SpatialInertia.SolidBoxWithMass(0.5, 0.1, 0.1, 0.1)
    load = plant.AddRigidBody("load", plant.AddModelInstance("load"), inertia)
    plant.SetDefaultFloatingBaseBodyPose(load, RigidTransform([0.0, 0.0, -0.3]))
    plant.Finalize()
    anchor, places = (load, (0.0, 0.0, 0.05)), ((0.08, 0.0), (-0.08, 0.07), (-0.08, -0.07))
    points = [[(in_plant.body, (x, y, -0.035)), anchor] for x, y in places]
    routes = {
        "robot": CableRoutes.of_cable_set(robot.cable_set(), int(in_plant.body_index)),
        "load": CableRoutes.of(plant, [CableRoute(points=p, stiffness=5e3) for p in points]),
    }
    settings, blocks = CableSettings(pulleys=True, stiffness_ratio=0.03), []
    for part, method in parts:
        if method == "robot":
            own = CableRobotSettings(cables=settings)
            block = add_cable_robot(builder, in_plant, own, name=part)
        else:
            block = add_cables(builder, plant, routes[part], settings, method=method, name=part)
        builder.ExportInput(block.GetInputPort("cable_velocities"), part)
        blocks.append((part, block))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    for part, block in blocks:
        still = np.zeros(routes[part].count)
        diagram.GetInputPort(part).FixValue(context, still)
        forces = diagram.GetSubsystemContext(block.forces, context)
        lengths = block.GetOutputPort("lengths").Eval(forces)
        winches = block.winches.GetMyMutableContextFromRoot(context)
        block.winches.hold(winches, 0.99 * lengths, still)
    own = plant.GetMyMutableContextFromRoot(context)
    plant.SetVelocities(own, 0.1 * np.cos(np.arange(plant.num_velocities())))
    accelerations = np.array(plant.get_generalized_acceleration_output_port().Eval(own))
    advance(diagram, context, 0.01, 2e-4)
    return accelerations


def test_robots_and_cables_share_a_plant():
    """Whoever adds them, forces add up; and it runs."""
    expected = accelerations_of_shared_plant(WAYS["robot, then cables"])
    size = np.max(np.abs(expected))
    assert size > 10.0
    for way, parts in WAYS.items():
        accelerations = accelerations_of_shared_plant(parts)
        np.testing.assert_allclose(accelerations, expected, rtol=0, atol=ORDER * size, err_msg=way)


def test_joints_that_are_not_compiled_take_forces_on_bodies_and_say_so():
    builder = DiagramBuilder()
    plant, routes = screw_plant(builder)
    ports = add_cables(builder, plant, routes, method="automatic")
    assert ports.method == "bodies"
    assert "joint thread: found a ScrewJoint" in ports.why
    assert Cabled("hanging_arm", "bodies").ports.why == ""
    assert Cabled("hanging_arm", "automatic").ports.method == "joints"
    builder.ExportInput(ports.GetInputPort("cable_velocities"), "cable_velocities")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    diagram.GetInputPort("cable_velocities").FixValue(context, np.zeros(1))
    ports.winches.hold(ports.winches.GetMyMutableContextFromRoot(context), [0.9], [0.0])
    own = plant.GetMyContextFromRoot(context)
    force = ports.cables().generalized_force(own, np.array([0.9]))
    assert abs(force[0]) > 1.0
    acceleration = plant.get_generalized_acceleration_output_port().Eval(own)
    inertial = plant.CalcMassMatrix(own) @ acceleration
    weight = plant.CalcGravityGeneralizedForces(own)
    np.testing.assert_allclose(inertial - weight, force, rtol=ORDER)


def masts(winches=None, **ends):
    """Cables over eyelets on masts, on such winches, at rest, with bases that are held."""
    builder = DiagramBuilder()
    it = machine("mobile_masts", builder)
    routes = it.with_ends(stiffness=2e4, retardation=0.02, **ends)
    home, _ = PlantCables(it.plant, routes).lengths_and_jacobian(it.home())
    blocks = add_cables(builder, it.plant, routes, winches=winches and winches(home))
    rest = hang(PlantCables(it.plant, routes), it.home(), prestress=20.0, lower=5.0)
    motors = builder.AddSystem(ConstantVectorSource(rest.held))
    apply_force(builder, it.plant, motors.get_output_port(), name="motors")
    bases = builder.AddSystem(DrivenBases(it.plant))
    bases.WAY = 0.0
    builder.Connect(it.plant.get_state_output_port(), bases.GetInputPort("plant_state"))
    apply_force(builder, it.plant, bases.GetOutputPort("force"), name="bases")
    return builder, it, blocks, rest


def test_motors_hold_a_machine_that_hangs():
    """From torques that are computed from the tensions, to rounding, and only friction damps."""
    law = shipped("acrobot_small").winch_law()
    builder, it, blocks, rest = masts(lambda home: MotorWinch(law, "velocity", home))
    zero = builder.AddSystem(ConstantVectorSource(np.zeros(8)))
    builder.Connect(zero.get_output_port(), blocks.GetInputPort("cable_velocities"))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    blocks.put(context, rest)
    if blocks.HasInputPort("brakes"):
        winches = blocks.winches.GetMyMutableContextFromRoot(context)
        blocks.GetInputPort("brakes").FixValue(winches, np.zeros(8))
    own = it.plant.GetMyContextFromRoot(context)
    before = it.plant.GetPositions(own).copy()
    advance(diagram, context, 0.1, 2.5e-4)
    np.testing.assert_allclose(it.plant.GetPositions(own), before, rtol=0, atol=1e-8)


def test_tension_correction_takes_up_slack_of_a_cable_over_eyelets():
    builder, _, blocks, rest = masts()
    law = ConstantThreshold(np.full(8, 10.0), np.full(8, 2e-3))
    corrector = builder.AddSystem(TensionCorrector(law, 8, 200.0))
    zero = builder.AddSystem(ConstantVectorSource(np.zeros(8)))
    for output, port in (
        (blocks.GetOutputPort("tensions"), corrector.GetInputPort("tensions")),
        (blocks.GetOutputPort("unstrained_lengths"), corrector.GetInputPort("lengths")),
        (zero.get_output_port(), corrector.GetInputPort("commanded_velocities")),
        (corrector.GetOutputPort("cable_velocities"), blocks.GetInputPort("cable_velocities")),
    ):
        builder.Connect(output, port)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    blocks.put(context, rest)
    winches = blocks.winches.GetMyMutableContextFromRoot(context)
    paid_out = 0.01 * np.eye(8)[0]  # m: more than the cable is stretched by
    blocks.winches.set_unstrained_lengths(winches, rest.unstrained_lengths + paid_out)
    forces = blocks.forces.GetMyContextFromRoot(context)
    assert blocks.GetOutputPort("slack").Eval(forces)[0] == 1.0
    advance(diagram, context, 0.6, 5e-4)
    assert blocks.GetOutputPort("tensions").Eval(forces)[0] > 5.0


def test_a_breaking_load_bounds_hanging_and_is_watched():
    loads = np.where(np.arange(8) == 2, 42.0, np.inf)
    builder, it, blocks, rest = masts(breaking_load=loads)
    assert rest.tensions[2] > 33.0
    weaker = PlantCables(it.plant, it.with_ends(breaking_load=np.where(loads < 50, 33.0, loads)))
    assert hang(weaker, it.home(), prestress=20.0, lower=5.0).tensions[2] <= 33.0
    weak = PlantCables(it.plant, it.with_ends(breaking_load=0.01))
    with pytest.raises(InfeasibleTensionError, match=r"0\.01 N"):
        hang(weak, it.home(), lower=0.0)
    watch = builder.AddSystem(BreakingLoadWatch(loads, stop=True))
    builder.Connect(blocks.GetOutputPort("tensions"), watch.GetInputPort("tensions"))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    blocks.put(context, rest)
    winches = blocks.winches.GetMyMutableContextFromRoot(context)
    pull = np.where(np.arange(8) == 2, -0.05, 0.0)
    blocks.GetInputPort("cable_velocities").FixValue(winches, pull)
    advance(diagram, context, 0.2, 2.5e-4)
    broken = watch.broken(watch.GetMyContextFromRoot(context))
    assert 0.0 < broken[2] <= context.get_time() < 0.2
    assert np.all(np.delete(broken, 2) == -1.0)
