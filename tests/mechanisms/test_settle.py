"""Where mechanisms come to rest on given lengths: from anywhere near, stable, to rounding."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia
from scipy.optimize import minimize

from cdpr_drake.errors import CableModelError
from cdpr_drake.geometry.cable_routes import CableRoute, CableRoutes
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import _Model, hang, moved, rows_of_motors, settle
from tests.mechanisms.cabled import alone, cables_of, random_states, rest_of
from tests.mechanisms.machines import STANDING, STIFFNESS

STARTS = 3

ROUNDING = 1e-14
"""Forces left at rest, as a share of E S [-]: lengths of a metre are rounded to 1e-16, and cables
add up. Found 4e-16."""

SAME = 1e-9
"""How far two ways to one rest end apart [m, rad], and as a share of E S; found 2e-15."""

FIBRE = 348717.0
"""E S of the 2 mm rope of ACROBOT [N], with which cables slacken by micrometres."""


def stiff(name, stiffness):
    return PlantCables(alone(name).plant, alone(name).with_ends(stiffness=stiffness))


@pytest.mark.parametrize("stiffness", [STIFFNESS, FIBRE], ids=["soft", "fibre"])
@pytest.mark.parametrize("name", STANDING)
def test_it_ends_stable_from_random_starts_and_lengths(name, stiffness):
    """Lengths of 4 mm a metre off: with fibres a part of the cables is slack then."""
    cables, context = stiff(name, stiffness), alone(name).home()
    l0 = hang(cables, context, lower=1.0, upper=60.0).unstrained_lengths
    random = np.random.default_rng(51)
    for q, _ in random_states(name, STARTS, seed=52, spread=1.0):
        cables.plant.SetPositions(context, q)
        rest = settle(cables, context, l0 * (1.0 + random.uniform(-0.004, 0.004, len(l0))))
        assert rest.stability == "stable"
        assert rest.residual < ROUNDING * stiffness


@pytest.mark.parametrize("name", STANDING)
def test_it_finds_what_hang_found(name):
    """From two millimetres beside it, with the lengths that hold it."""
    rest, context, cables = rest_of(name), alone(name).home(), cables_of(name)
    nv = cables.plant.num_velocities()
    step = np.where(rows_of_motors(cables.plant), 0.0, 2e-3 * np.cos(np.arange(nv)))
    cables.plant.SetPositions(context, moved(cables.plant, rest.positions, step))
    again = settle(cables, context, rest.unstrained_lengths)
    assert np.max(np.abs(again.positions - rest.positions)) < SAME
    assert np.max(np.abs(again.held - rest.held)) < SAME * STIFFNESS
    assert np.max(np.abs(again.tensions - rest.tensions)) < SAME * STIFFNESS


@pytest.mark.parametrize("angle", [np.pi, 2.9])
def test_an_arm_that_stands_upright_comes_down(angle):
    """At pi it is at rest, but would not stay there."""
    cables, context = cables_of("hanging_arm"), alone("hanging_arm").home()
    plant, rest = cables.plant, rest_of("hanging_arm")
    start = np.array(rest.positions)
    start[plant.GetJointByName("shoulder").position_start()] = angle
    plant.SetPositions(context, start)
    down = settle(cables, context, rest.unstrained_lengths)
    assert down.stability == "stable"
    heights = []
    for q in (start, down.positions):
        plant.SetPositions(context, q)
        heights.append(cables.energy(context, rest.unstrained_lengths))
    assert heights[1] < heights[0] - 1.0


def test_a_cable_at_the_edge_of_slack_does_not_hide_the_rest():
    """A cable whose tension at rest is that of a stretch of a tenth of a micrometre."""
    cables, context = stiff("two_platforms", FIBRE), alone("two_platforms").home()
    wanted = np.full(16, 20.0)
    rest = hang(cables, context, lower=1.0, upper=100.0, prestress=wanted)
    slacker = cables.outputs(context, rest.unstrained_lengths)[2].copy()
    slacker[[0, 5]] -= 1e-7
    l0 = rest.unstrained_lengths.copy()
    l0[[0, 5]] = slacker[[0, 5]]
    cables.plant.SetPositions(context, next(random_states("two_platforms", 1, seed=54))[0])
    found = settle(cables, context, l0)
    assert found.stability == "stable"
    assert found.residual < ROUNDING * FIBRE


def test_what_nothing_resists_stays_where_it_is():
    """A body on one cable swings to below its exit point, however it is turned about the cable."""
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("body", SpatialInertia.SolidBoxWithMass(2.0, 0.3, 0.2, 0.1))
    plant.Finalize()
    points = [(plant.world_body(), (0.0, 0.0, 1.0)), (body, (0.0, 0.0, 0.05))]
    routes = CableRoutes.of(plant, [CableRoute(points=points, stiffness=STIFFNESS)])
    context = plant.CreateDefaultContext()
    turned = RollPitchYaw(0.3, -0.2, 0.9)
    plant.SetFreeBodyPose(context, body, RigidTransform(turned, [0.2, 0.1, -0.1]))
    rest = settle(PlantCables(plant, routes), context, [1.0])
    assert rest.stability == "neutral"
    assert rest.residual < ROUNDING * STIFFNESS
    assert np.max(np.abs(rest.positions[4:6])) < 1e-6  # below the exit point


def test_a_step_of_the_model_follows_cables_that_catch_and_let_go():
    """Least energy of springs that only pull, against a program that knows nothing of kinks."""
    random = np.random.default_rng(56)
    changed = 0
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
        found = minimize(energy, np.zeros(4), method="BFGS", options={"gtol": 1e-9})
        assert energy(d) < found.fun + 1e-9
        changed += not np.array_equal(model.stretch > 0.0, model.stretch + model.J @ d > 0.0)
    assert changed > 10


def test_cables_that_sag_settle_too():
    routes = alone("two_platforms").with_ends(linear_weight=0.03)
    cables = PlantCables(alone("two_platforms").plant, routes, "catenary")
    context = alone("two_platforms").home()
    cables.plant.SetPositions(context, next(random_states("two_platforms", 1, seed=55))[0])
    rest = settle(cables, context, 1.001 * rest_of("two_platforms").unstrained_lengths)
    assert rest.stability == "stable"
    assert rest.residual < ROUNDING * STIFFNESS


def test_everything_held_needs_no_step():
    cables, context = cables_of("planar_arm"), alone("planar_arm").home()
    l0 = rest_of("planar_arm").unstrained_lengths
    rest = settle(cables, context, 0.99 * l0, held=["shoulder", "elbow"])
    np.testing.assert_array_equal(rest.positions, cables.plant.GetPositions(context))
    assert np.max(np.abs(rest.held)) > 1.0
    assert rest.stability == "stable"


def test_cables_that_do_not_stretch_are_refused():
    cables = replace(cables_of("planar_arm"), model="inextensible")
    with pytest.raises(CableModelError, match="accepted: one of elastic"):
        settle(cables, alone("planar_arm").home(), rest_of("planar_arm").unstrained_lengths)
