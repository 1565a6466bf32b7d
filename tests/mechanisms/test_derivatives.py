"""Jacobians and AutoDiff of cables between bodies, against differences and against Drake."""

import numpy as np
import pytest
from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.primitives import Linearize

from cdpr_drake.geometry.tree_kernel import MOTION, TREE_WORK, tree_motion
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import moved
from cdpr_drake.models.plant_tree import PlantTree
from tests.mechanisms.cabled import (
    METHODS,
    Cabled,
    alone,
    random_states,
    rest_of,
    taut_lengths,
)
from tests.mechanisms.machines import MACHINES

STATES = 3

STEP = 1e-6
"""Of central differences [rad, m]: rounding of lengths of metres over it is 4e-10."""

LENGTH_SLOPE = 1e-8
"""Of J_l against differences [m/m, m/rad]; found 1e-9."""

FORCE_SLOPE = 1e-6
"""Of derivatives of a state's rate, as a share of the largest; found 7e-10."""

AGREES = 1e-12
"""Of forces by two ways through the same joints, as a share of the largest; found 8e-15."""

FREQUENCY = 1e-9
"""Of eigenvalues of a linearized plant against those of its stiffness by differences, as a share of
the largest; found 1e-12."""

PULLEYS = {"pulley_radius": 0.02, "anchor_pulley_radius": 0.015}


def differences(function, x0):
    """Central differences of a function of an array, by its entries."""
    columns = []
    for e in np.eye(len(x0)):
        columns.append((function(x0 + STEP * e) - function(x0 - STEP * e)) / (2.0 * STEP))
    return np.array(columns).T


@pytest.mark.parametrize("ends", [{}, PULLEYS], ids=["points", "pulleys"])
@pytest.mark.parametrize("name", MACHINES)
def test_length_jacobian_is_the_slope_of_lengths(name, ends):
    plant = alone(name).plant
    cables = PlantCables(plant, alone(name).with_ends(**ends))
    context, nv = alone(name).home(), plant.num_velocities()
    for q, _ in random_states(name, STATES, seed=21):

        def lengths(step, q=q):
            plant.SetPositions(context, moved(plant, q, step))
            return cables.lengths_and_jacobian(context)[0]

        slopes = differences(lengths, np.zeros(nv))
        plant.SetPositions(context, q)
        assert np.max(np.abs(cables.length_jacobian(context) - slopes)) < LENGTH_SLOPE


@pytest.mark.parametrize("name", MACHINES)
def test_compiled_joints_move_bodies_as_drake_does(name):
    plant, routes = alone(name).plant, alone(name).routes
    tree = PlantTree.of(plant, routes.touched_bodies())
    motion, work = np.zeros((len(tree.table), MOTION)), np.zeros(TREE_WORK)
    motion[0, [0, 4, 8]] = 1.0
    context = alone(name).home()
    for q, v in random_states(name, STATES, seed=22, spread=1.0, speed=2.0):
        plant.SetPositions(context, q)
        plant.SetVelocities(context, v)
        tree_motion(tree.table, np.concatenate([q, v]), work, motion)
        for body, row in tree.rows.items():
            X = plant.EvalBodyPoseInWorld(context, plant.get_body(BodyIndex(body)))
            V = plant.EvalBodySpatialVelocityInWorld(context, plant.get_body(BodyIndex(body)))
            theirs = [*X.rotation().matrix().ravel(), *X.translation(), *V.get_coeffs()]
            assert np.max(np.abs(motion[row] - theirs)) < AGREES


@pytest.mark.parametrize("ends", [{}, PULLEYS | {"retardation": 1e-3}], ids=["points", "pulleys"])
@pytest.mark.parametrize("name", MACHINES)
def test_forces_on_joints_are_those_by_drakes_jacobians(name, ends):
    cabled = Cabled(name, ends=ends)
    l0 = 0.9 * taut_lengths(name)  # some slack, some taut
    cabled.set_lengths(l0)
    for q, v in random_states(name, STATES, seed=23):
        cabled.set_state(q, v)
        ours = cabled.output("generalized_force")
        theirs = cabled.cables.generalized_force(cabled.plant_context, l0)
        assert np.max(np.abs(ours - theirs)) < AGREES * np.max(np.abs(theirs))


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


@pytest.mark.parametrize("ends", [{}, PULLEYS | {"retardation": 1e-3}], ids=["points", "pulleys"])
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", MACHINES)
def test_autodiff_is_the_slope_of_the_rates(name, method, ends):
    """By all of the state, lengths on the winches among it, where no cable is about to catch."""
    cabled = Cabled(name, method, ends=ends)
    every_third = np.arange(len(taut_lengths(name))) % 3 == 0
    lengths = taut_lengths(name) * np.where(every_third, 1.1, 0.95)
    cabled.set_lengths(lengths)
    (q, v), *_ = random_states(name, 1, seed=24, spread=0.02)
    cabled.set_state(q, v)
    strain = cabled.output("lengths") / lengths - 1.0
    assert np.min(np.abs(strain)) > 1e-4
    assert 0.0 < np.mean(strain > 0.0) < 1.0
    x = cabled.context.get_continuous_state_vector().CopyToVector()
    ours, theirs = slopes_by_autodiff(cabled, x), differences(lambda y: rates(cabled, y), x)
    assert np.max(np.abs(ours - theirs)) < FORCE_SLOPE * np.max(np.abs(theirs))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["two_platforms", "mobile_bases"])
def test_autodiff_of_cables_that_sag(name, method):
    """Some of them between bodies that move, some taut and some not."""
    ends = {"linear_weight": 0.4, "retardation": 1e-3}
    cabled = Cabled(name, method, model="catenary", ends=ends)
    every_third = np.arange(len(taut_lengths(name))) % 3 == 0
    cabled.set_lengths(taut_lengths(name) * np.where(every_third, 1.1, 0.95))
    cabled.set_state(*next(random_states(name, 1, seed=25, spread=0.02)))
    assert 0.0 < np.mean(cabled.output("sags") > 0.05) < 1.0  # m
    x = cabled.context.get_continuous_state_vector().CopyToVector()
    ours, theirs = slopes_by_autodiff(cabled, x), differences(lambda y: rates(cabled, y), x)
    assert np.max(np.abs(ours - theirs)) < FORCE_SLOPE * np.max(np.abs(theirs))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["hanging_arm", "human_arm", "two_platforms"])
def test_a_plant_linearized_swings_as_its_stiffness_says(name, method):
    cabled, rest = Cabled(name, method), rest_of(name)
    cabled.ports.put(cabled.context, rest)
    linear = Linearize(cabled.diagram, cabled.context, equilibrium_check_tolerance=1e-6)
    found = np.linalg.eigvals(linear.A())
    squared = np.sort(found.imag[found.imag > 1e-2] ** 2)
    theirs = np.sort(rest.squared_frequencies)
    assert np.max(np.abs(squared - theirs)) < FREQUENCY * theirs[-1]


def test_a_tree_has_rows_only_for_what_cables_need():
    """The arm below a platform has no cables: its joints are not walked."""
    plant = alone("hanging_arm").plant
    tree = PlantTree.of(plant, alone("hanging_arm").routes.touched_bodies())
    assert len(tree.table) == 2
