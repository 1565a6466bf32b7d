"""Lengths, forces and their slopes against differences, energy, power and Drake's joints."""

import numpy as np
import pytest
from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from pydrake.multibody.tree import BodyIndex, JacobianWrtVariable
from pydrake.systems.primitives import Linearize

from cdpr_drake.geometry.cable_routes import CableRoute, CableRoutes
from cdpr_drake.geometry.tree_kernel import MOTION, TREE_WORK, tree_motion
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import moved
from cdpr_drake.models.plant_tree import PlantTree
from cdpr_drake.systems.robots.tension_driven_routes import TensionDrivenRoutes
from tests.mechanisms.machines import MACHINES, STANDING
from tests.mechanisms.mechanism_cases import (
    METHODS,
    PULLEYS,
    Cabled,
    alone,
    cables_of,
    mixed_lengths,
    random_states,
    rest_of,
    taut_lengths,
)

FAR = 2e-4  # differences of fourth order, whose error is some 1e-12 of the slope [s, rad, m]
NEAR = 1e-6  # differences of second order [rad, m]
SLOPE = 1e-9  # of lengths, whose rounding differences magnify; of m/m and m/rad. Found 2e-11
GRADIENT = 1e-8  # of energy by differences, share of the largest; a sag is solved to 1e-10
RATES = 1e-6  # slopes of a state's rates, share of the largest; found 7e-10
AGREES = 1e-12  # two ways through the same joints, share of the largest; found 8e-15
FREQUENCY = 1e-9  # of eigenvalues, share of the largest; found 1e-12

ends = pytest.mark.parametrize("ends", [{}, PULLEYS], ids=["points", "pulleys"])
machines = pytest.mark.parametrize("name", MACHINES)


def slope(function):
    near, far = (function(k * FAR) - function(-k * FAR) for k in (1.0, 2.0))
    return (8.0 * near - far) / (12.0 * FAR)


@ends
@machines
def test_jacobian_is_the_slope_of_lengths_and_tensions_follow_law_and_jacobian(name, ends):
    """t = E S (e + T de/dt), pulled along J': power on bodies is what the cables lose."""
    plant, T = alone(name).plant, 5e-3
    cables, elastic = cables_of(name, retardation=T, **ends), cables_of(name, **ends)
    context, l0 = alone(name).home(), 0.8 * taut_lengths(name)
    l0_rate, stiffness = 0.1 * np.cos(np.arange(len(l0))), cables.routes.ends.stiffness
    for q, v in random_states(name, 3, seed=21):

        def lengths(step, q=q):
            plant.SetPositions(context, moved(plant, q, step))
            return cables.lengths_and_jacobian(context)[0]

        rows = np.eye(len(v))
        slopes = np.array([slope(lambda h, e=e: lengths(h * e)) for e in rows]).T
        length, rate = lengths(0.0 * v), slope(lambda h, v=v: lengths(h * v))
        plant.SetPositions(context, q)
        plant.SetVelocities(context, v)
        J = cables.length_jacobian(context)
        np.testing.assert_allclose(J, slopes, rtol=0, atol=SLOPE)
        strain_rate = (rate - length * l0_rate / l0) / l0
        pulls = np.maximum(stiffness * (length / l0 - 1.0 + T * strain_rate), 0.0)
        assert np.mean(pulls > 0.0) > 0.5
        t = cables.outputs(context, l0, l0_rate)[0]
        np.testing.assert_allclose(t, pulls, rtol=0, atol=SLOPE * np.max(pulls))
        t, tau = elastic.outputs(context, l0)[0], elastic.generalized_force(context, l0)
        exchanged = float(np.sum(np.abs(t * rate)))
        assert exchanged > 1.0
        assert abs(float(v @ tau + t @ rate)) < SLOPE * exchanged


@machines
def test_compiled_joints_move_bodies_as_drake_does(name):
    plant, routes = alone(name).plant, alone(name).routes
    tree = PlantTree.of(plant, routes.touched_bodies())
    motion, work = np.zeros((len(tree.table), MOTION)), np.zeros(TREE_WORK)
    motion[0, [0, 4, 8]] = 1.0
    context = alone(name).home()
    for q, v in random_states(name, 3, seed=22, spread=1.0, speed=2.0):
        plant.SetPositions(context, q)
        plant.SetVelocities(context, v)
        tree_motion(tree.table, np.concatenate([q, v]), work, motion)
        for index, row in tree.rows.items():
            body = plant.get_body(BodyIndex(index))
            X = plant.EvalBodyPoseInWorld(context, body)
            V = plant.EvalBodySpatialVelocityInWorld(context, body).get_coeffs()
            expected = [*X.rotation().matrix().ravel(), *X.translation(), *V]
            np.testing.assert_allclose(motion[row], expected, rtol=0, atol=AGREES)


def test_a_tree_has_rows_only_for_what_cables_need():
    """The arm below a platform has no cables: its joints are not walked."""
    it = alone("hanging_arm")
    assert len(PlantTree.of(it.plant, it.routes.touched_bodies()).table) == 2


@pytest.mark.parametrize(
    "ends", [{}, PULLEYS | {"retardation": 1e-3}], ids=["points", "damped pulleys"]
)
@machines
def test_forces_on_joints_are_those_by_drakes_jacobians(name, ends):
    cabled, l0 = Cabled(name, ends=ends), 0.9 * taut_lengths(name)  # some slack, some taut
    cabled.set_lengths(l0)
    for q, v in random_states(name, 3, seed=23):
        cabled.set_state(q, v)
        expected = cabled.cables.generalized_force(cabled.plant_context, l0)
        size = np.max(np.abs(expected))
        force = cabled.output("generalized_force")
        np.testing.assert_allclose(force, expected, rtol=0, atol=AGREES * size)


@pytest.mark.parametrize("name", STANDING)
def test_commanded_tensions_pull_by_the_jacobian(name):
    it, random = alone(name), np.random.default_rng(1)
    block, context = TensionDrivenRoutes(it.plant, it.routes), it.home()
    it.plant.SetVelocities(context, random.uniform(-1.0, 1.0, it.plant.num_velocities()))
    J = cables_of(name).length_jacobian(context)
    tensions = random.uniform(-20.0, 50.0, it.routes.count)
    own = block.CreateDefaultContext()
    block.GetInputPort("plant_state").FixValue(own, it.plant.GetPositionsAndVelocities(context))
    block.GetInputPort("tensions").FixValue(own, tensions)
    force = block.GetOutputPort("generalized_force").Eval(own)
    np.testing.assert_allclose(force, -J.T @ np.maximum(tensions, 0.0), rtol=0, atol=1e-9)
    rates = block.GetOutputPort("length_rates").Eval(own)
    np.testing.assert_allclose(rates, J @ it.plant.GetVelocities(context), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(block.GetOutputPort("slack").Eval(own), tensions <= 0.0)


def rates(cabled, x):
    cabled.context.SetContinuousState(x)
    return cabled.diagram.EvalTimeDerivatives(cabled.context).CopyToVector()


def slopes_by_autodiff(cabled, x):
    diagram = cabled.diagram.ToAutoDiffXd()
    context = diagram.CreateDefaultContext()
    context.SetTimeStateAndParametersFrom(cabled.context)
    diagram.FixInputPortsFrom(cabled.diagram, cabled.context, context)
    context.SetContinuousState(InitializeAutoDiff(x).ravel())
    return ExtractGradient(diagram.EvalTimeDerivatives(context).CopyToVector())


SAGGING = {"linear_weight": 0.4, "retardation": 1e-3}
CASES = [
    *((name, "kelvin_voigt", {}) for name in MACHINES),
    *((name, "kelvin_voigt", PULLEYS | {"retardation": 1e-3}) for name in MACHINES),
    ("two_platforms", "catenary", SAGGING),
    ("mobile_bases", "catenary", SAGGING),
]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("name", "model", "ends"), CASES)
def test_autodiff_is_the_slope_of_the_rates(name, model, ends, method):
    """By all of the state, lengths on the winches among it, where no cable is about to catch."""
    cabled = Cabled(name, method, model=model, ends=ends)
    lengths = mixed_lengths(name)
    cabled.set_lengths(lengths)
    cabled.set_state(*next(random_states(name, 1, seed=24, spread=0.02)))
    if model == "catenary":
        assert 0.0 < np.mean(cabled.output("sags") > 0.05) < 1.0  # m
    else:
        strain = cabled.output("lengths") / lengths - 1.0
        assert np.min(np.abs(strain)) > 1e-4
        assert 0.0 < np.mean(strain > 0.0) < 1.0
    x = cabled.context.get_continuous_state_vector().CopyToVector()
    steps = NEAR * np.eye(len(x))
    columns = [(rates(cabled, x + h) - rates(cabled, x - h)) / (2.0 * NEAR) for h in steps]
    slopes, size = np.array(columns).T, np.max(np.abs(columns))
    np.testing.assert_allclose(slopes_by_autodiff(cabled, x), slopes, rtol=0, atol=RATES * size)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["hanging_arm", "human_arm", "two_platforms"])
def test_a_plant_linearized_swings_as_its_stiffness_says(name, method):
    cabled, rest = Cabled(name, method), rest_of(name)
    cabled.ports.put(cabled.context, rest)
    linear = Linearize(cabled.diagram, cabled.context, equilibrium_check_tolerance=1e-6)
    imaginary = np.linalg.eigvals(linear.A()).imag
    squared, expected = np.sort(imaginary[imaginary > 1e-2] ** 2), np.sort(rest.squared_frequencies)
    np.testing.assert_allclose(squared, expected, rtol=0, atol=FREQUENCY * expected[-1])


def test_a_cable_that_sags_is_damped_as_its_exit_point_moves():
    """As from a point of the world that is there, with velocities as seen from the exit point."""
    plant, context = alone("two_platforms").plant, alone("two_platforms").home()
    W, left, right = plant.world_frame(), *map(plant.GetBodyByName, ("left", "right"))
    p_LA, p_RB = np.array([0.09, 0.085, -0.035]), np.array([-0.09, 0.085, 0.035])
    q, v = next(random_states("two_platforms", 1, seed=35))
    plant.SetPositions(context, q)
    p_WA = plant.CalcPointsPositions(context, left.body_frame(), p_LA, W).ravel()
    J = plant.CalcJacobianTranslationalVelocity(
        context, JacobianWrtVariable.kV, left.body_frame(), p_LA, W, W
    )
    seen, start = v.copy(), right.floating_velocities_start_in_v()
    seen[start + 3 : start + 6] -= J @ v
    tensions = []
    for exit_point, velocities in (((left, p_LA), v), ((plant.world_body(), p_WA), seen)):
        route = CableRoute(
            points=[exit_point, (right, p_RB)], stiffness=1e4, linear_weight=0.4, retardation=0.01
        )
        cables = PlantCables(plant, CableRoutes.of(plant, [route]), "catenary")
        plant.SetVelocities(context, velocities)
        length, _ = cables.lengths_and_jacobian(context)
        tensions.append(cables.outputs(context, 0.95 * length)[0, 0])
    assert abs(tensions[0] - tensions[1]) < 1e-12 * tensions[0]


@pytest.mark.parametrize(
    ("name", "ends"),
    [("two_platforms", {}), ("mobile_bases", {}), ("hanging_arm", {"pulley_radius": 0.02})],
)
def test_forces_of_cables_that_sag_are_the_slope_of_their_energy(name, ends):
    """On both bodies: what the exit body gets is the pull at the exit point."""
    plant, cables = alone(name).plant, cables_of(name, "catenary", linear_weight=0.4, **ends)
    context = alone(name).home()
    l0 = taut_lengths(name) * np.where(np.arange(cables.routes.count) % 2, 0.93, 1.1)
    for q, v in random_states(name, 2, seed=32, spread=0.02):
        plant.SetPositions(context, q)
        tau, outputs = cables.generalized_force(context, l0), cables.outputs(context, l0)
        assert 0.0 < np.mean(outputs[5] > 0.05) < 1.0  # sags of 5 cm

        def energy(step, q=q):
            plant.SetPositions(context, moved(plant, q, step))
            return cables.energy(context, l0) - plant.CalcPotentialEnergy(context)

        slopes = [slope(lambda h, e=e: energy(h * e)) for e in np.eye(len(v))]
        np.testing.assert_allclose(
            tau, -np.array(slopes), rtol=0, atol=GRADIENT * np.max(np.abs(tau))
        )
