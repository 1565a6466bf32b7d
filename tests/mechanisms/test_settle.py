"""Where machines come to rest on given lengths: from anywhere near, stable, to rounding."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia
from scipy.optimize import minimize

from cdpr_drake.geometry.cable_routes import CableRoute, CableRoutes
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import _Model, hang, moved, rows_of_motors, settle
from tests.mechanisms.machines import STANDING, STIFFNESS
from tests.mechanisms.mechanism_cases import alone, cables_of, random_states, rest_of

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
