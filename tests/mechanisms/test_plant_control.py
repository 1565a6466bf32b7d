"""Computed torque, tension distribution and a visual servo for machines on cables."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from cdpr_drake.errors import TensionProblemError
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_statics import plant_tension_problem
from cdpr_drake.servoing.servo_law import AdaptiveGain
from cdpr_drake.servoing.servo_task import make_task
from cdpr_drake.servoing.visual_features import PointFeatures, sighting
from cdpr_drake.systems.controllers.link_servo import LinkServo
from cdpr_drake.systems.controllers.plant_tracking import PlantTensionDistributor, PlantTracking
from cdpr_drake.systems.robots.assembly import apply_force
from cdpr_drake.systems.robots.route_assembly import add_cables
from cdpr_drake.systems.robots.tension_driven_routes import TensionDrivenRoutes
from cdpr_drake.tensions.methods import distribute
from cdpr_drake.tensions.problem import TensionStatus
from tests.mechanisms.driven_bases import DrivenBases
from tests.mechanisms.machines import STANDING, machine
from tests.mechanisms.tracked import track

LIMITS = {"human_arm": (5.0, 400.0)}
"""Least and largest tensions [N]; (1, 300) of all others."""

CONTROLLED = tuple(name for name in STANDING if name != "hanging_arm")
"""What cables and motors can drive; a passive arm they cannot."""

HALVES = 1.8
"""Error of twice the period over that of one: it is of the first order, from the hold of tensions
over a period, with 10 % for what the motion and the last digits of the method add."""

ROUNDING = 1e-12
"""Of sums of some tens of products, relative."""


@pytest.mark.parametrize("name", CONTROLLED)
def test_computed_torque_follows_and_its_error_halves_with_the_period(name):
    limits = LIMITS.get(name, (1.0, 300.0))
    coarse, fine = track(name, limits, 250.0), track(name, limits, 500.0)
    assert (coarse.failures, fine.failures) == (0, 0)
    for found in (coarse, fine):
        assert limits[0] <= found.tensions[0] <= found.tensions[1] <= limits[1]
    assert coarse.error > HALVES * fine.error


def test_a_passive_arm_is_refused_by_its_rank():
    it = machine("hanging_arm")
    with pytest.raises(TensionProblemError, match="8 cables for 9 degrees of freedom"):
        PlantTensionDistributor(PlantCables(it.plant, it.routes), (1.0, 300.0))


def test_requests_that_cannot_be_met_keep_the_last_tensions_and_are_counted():
    it = machine("two_platforms")
    block = PlantTensionDistributor(PlantCables(it.plant, it.routes), (1.0, 300.0))
    context = block.CreateDefaultContext()
    home = it.home()
    block.GetInputPort("plant_state").FixValue(context, it.plant.GetPositionsAndVelocities(home))
    weight = -it.plant.CalcGravityGeneralizedForces(home)
    block.GetInputPort("desired_force").FixValue(context, weight)
    block.ExecuteForcedEvents(context)
    held = block.GetOutputPort("tensions").Eval(context).copy()
    assert block.GetOutputPort("feasible").Eval(context)[0] == 1.0
    assert np.all(held >= 1.0)
    assert np.ptp(held) > 1.0
    block.GetInputPort("desired_force").FixValue(context, 1e3 * weight)
    block.ExecuteForcedEvents(context)
    np.testing.assert_array_equal(block.GetOutputPort("tensions").Eval(context), held)
    assert block.GetOutputPort("feasible").Eval(context)[0] == 0.0
    assert block.GetOutputPort("failures").Eval(context)[0] == 1.0


@pytest.mark.parametrize("method", ["quadratic_program", "linear_program", "log_barrier"])
def test_every_method_takes_the_generalized_equation(method):
    it = machine("mobile_masts")
    context = it.home()
    problem = plant_tension_problem(PlantCables(it.plant, it.routes), context, limits=(1.0, 300.0))
    assert problem.W.shape == (6, 8)
    found = distribute(problem, method)
    assert found.status == TensionStatus.FEASIBLE
    # What it says, held against the plant: these tensions and no others let it rest.
    still = -it.plant.CalcGravityGeneralizedForces(context)
    rows = slice(*_platform_rows(it))
    J = PlantCables(it.plant, it.routes).length_jacobian(context)
    np.testing.assert_allclose((-J.T @ found.tensions)[rows], still[rows], atol=1e-6)


def _platform_rows(it):
    joint = it.plant.GetJointByName("platform")
    return joint.velocity_start(), joint.velocity_start() + 6


@pytest.mark.parametrize("name", STANDING)
def test_commanded_tensions_pull_by_the_jacobian(name):
    it, random = machine(name), np.random.default_rng(1)
    block, context = TensionDrivenRoutes(it.plant, it.routes), it.home()
    it.plant.SetVelocities(context, random.uniform(-1.0, 1.0, it.plant.num_velocities()))
    J = PlantCables(it.plant, it.routes).length_jacobian(context)
    tensions = random.uniform(-20.0, 50.0, it.routes.count)
    own = block.CreateDefaultContext()
    block.GetInputPort("plant_state").FixValue(own, it.plant.GetPositionsAndVelocities(context))
    block.GetInputPort("tensions").FixValue(own, tensions)
    force = block.GetOutputPort("generalized_force").Eval(own)
    np.testing.assert_allclose(force, -J.T @ np.maximum(tensions, 0.0), rtol=0, atol=1e3 * ROUNDING)
    rates = block.GetOutputPort("length_rates").Eval(own)
    np.testing.assert_allclose(rates, J @ it.plant.GetVelocities(context), rtol=0, atol=ROUNDING)
    np.testing.assert_array_equal(block.GetOutputPort("slack").Eval(own), tensions <= 0.0)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda it: PlantTracking(it.plant, -1.0, 1.0), "kp: found -1.0; accepted: one finite"),
        (lambda it: PlantTracking(it.plant, 1.0, np.ones(3)), "kd: found"),
        (
            lambda it: PlantTracking(it.plant, 1.0, 1.0, machine("planar_arm").plant),
            "believed: found 2 positions",
        ),
        (
            lambda it: PlantTensionDistributor(
                PlantCables(it.plant, it.routes), (1.0, 300.0), rate=0.0
            ),
            "rate: found 0",
        ),
        (
            lambda it: PlantTensionDistributor(
                PlantCables(it.plant, it.routes), (1.0, 300.0), "closed"
            ),
            "closed",
        ),
    ],
)
def test_what_makes_no_sense_is_said(build, words):
    with pytest.raises(TensionProblemError, match=words):
        build(machine("two_platforms"))


MARKS = 0.1 * np.array([[-1.0, 1.0, 1.0, -1.0], [-1.0, -1.0, 1.0, 1.0], np.zeros(4)])
"""Marks of a target, corners of a square of 0.2 m."""

X_PC = RigidTransform(RollPitchYaw(np.pi, 0.0, 0.0), [0.0, 0.0, -0.08])
"""A camera below the platform that looks down."""

X_WO = RigidTransform(RollPitchYaw(np.pi, 0.0, 0.2), [0.06, -0.05, 0.02])
"""A target on the ground that looks up."""

X_CO_WANTED = RigidTransform(RollPitchYaw(0.0, 0.0, 0.0), [0.0, 0.0, 0.65])


RATE = 60.0
"""Images per second [Hz]."""


class Eye(LeafSystem):
    """What an ideal camera on the platform sees of the target."""

    def __init__(self, plant):
        super().__init__()
        self._plant, self._own = plant, plant.CreateDefaultContext()
        self._state = self.DeclareVectorInputPort("plant_state", plant.num_multibody_states())
        self.DeclareAbstractOutputPort("X_CO", lambda: Value(RigidTransform()), self._calc_pose)
        self.DeclareVectorOutputPort("marks", 8, self._calc_marks)

    def pose(self, context):
        self._plant.SetPositionsAndVelocities(self._own, self._state.Eval(context))
        body = self._plant.GetBodyByName("platform")
        return (self._plant.EvalBodyPoseInWorld(self._own, body) @ X_PC).inverse() @ X_WO

    def _calc_pose(self, context, output):
        output.set_value(self.pose(context))

    def _calc_marks(self, context, output):
        p = self.pose(context).multiply(MARKS)
        output.SetFromVector((p[:2] / p[2]).T.ravel())


def servo_on_moving_bases(duration):
    """|s - s*| at first and at most in the last tenth, of an IBVS on bases that drive."""
    builder = DiagramBuilder()
    it = machine("mobile_bases", builder)
    plant = it.plant
    routes = it.with_ends(stiffness=1e5, retardation=0.02)
    blocks = add_cables(builder, plant, routes)
    eye, bases = builder.AddSystem(Eye(plant)), builder.AddSystem(DrivenBases(plant))
    p = X_CO_WANTED.multiply(MARKS)
    features = PointFeatures(MARKS, X_CO_WANTED)
    task = make_task(features, sighting(X_CO_WANTED, p[:2] / p[2]))
    cables = PlantCables(plant, routes)
    camera = plant.GetFrameByName("platform"), X_PC
    servo = builder.AddSystem(
        LinkServo(cables, camera, task, AdaptiveGain(2.0, 2.0, 0.0), RATE, marks=(2, 4))
    )
    state = plant.get_state_output_port()
    for block in (eye, bases):
        builder.Connect(state, block.GetInputPort("plant_state"))
    builder.Connect(bases.GetOutputPort("believed_state"), servo.GetInputPort("plant_state"))
    for port in ("X_CO", "marks"):
        builder.Connect(eye.GetOutputPort(port), servo.GetInputPort(port))
    builder.Connect(
        servo.GetOutputPort("cable_velocities"), blocks.GetInputPort("cable_velocities")
    )
    apply_force(builder, plant, bases.GetOutputPort("force"), name="bases")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    servo_context = servo.GetMyMutableContextFromRoot(context)
    servo.GetInputPort("found").FixValue(servo_context, [1.0])
    rest = blocks.hang(context, prestress=40.0, lower=10.0)
    assert rest.stability == "stable"
    simulator = Simulator(diagram, context)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    errors = []
    for k in range(1, 41):
        simulator.AdvanceTo(k * duration / 40)
        errors.append(np.linalg.norm(servo.GetOutputPort("error").Eval(servo_context)))
    return errors[0], max(errors[-4:])


LEFT = 0.05
"""Of the first error at the end: cables stretch anew as the geometry changes with the bases, which
moves the platform meanwhile; a fifth of the stiffness leaves five times as much."""

UNTOLD = 5.0
"""Times as much stays where the servo is not told how the bases move."""


def test_a_servo_converges_while_the_bases_move(monkeypatch):
    first, last = servo_on_moving_bases(4.0)
    assert first > 0.1
    assert last < LEFT * first
    monkeypatch.setattr(DrivenBases, "told", 0.0)
    assert servo_on_moving_bases(4.0)[1] > UNTOLD * last
