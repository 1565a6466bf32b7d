"""Stiffness, frequencies, dexterity and tension factors against functions of one pose and HiGHS."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from scipy.optimize import linprog

from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.stiffness import natural_modes, platform_stiffness
from cdpr_drake.workspaces.demanded_wrenches import weight_wrenches
from cdpr_drake.workspaces.static_feasibility import statically_feasible, wrench_matrices
from cdpr_drake.workspaces.stiffness import first_frequencies, held_tensions, stiffness_at
from cdpr_drake.workspaces.tension_factor import dexterities, tension_factors
from cdpr_drake.workspaces.wrench_capacity import scaled_matrices
from tests.workspaces.workspace_cases import random_poses, robot_case

SAME = 1e-7
"""Relative; two orders of summation, at stiffnesses of 1e5 N/m."""


@pytest.mark.parametrize("name", ["acrobot_large", "caroca", "planar"])
def test_stiffness_and_frequencies_are_those_of_single_poses(name):
    robot, case = robot_case(name, (1.0, 60.0) if name != "caroca" else None)
    body = rigid_platform(robot)
    positions, rotations = random_poses(robot, 30, seed=1, turn=0.1)
    found = stiffness_at(case, positions, rotations)
    inertia = (body.mass, body.p_PCo, body.I_PPo)
    frequencies = first_frequencies(found, case, inertia, rotations)
    tensions, held = held_tensions(case, positions, rotations)
    np.testing.assert_array_equal(held, statically_feasible(case, positions, rotations))
    assert held.sum() > 3
    rows = np.ix_(case.rows, case.rows)
    for k in np.flatnonzero(held):
        X_WP = RigidTransform(RotationMatrix(rotations[k]), positions[k])
        lengths = cable_paths(X_WP, case.cables).lengths
        l0 = lengths / (1.0 + tensions[k] / case.cables.stiffness)
        l0[tensions[k] == 0.0] *= 1.0 + 1e-9  # slack, not by rounding taut
        K = platform_stiffness(case.cables, "elastic", body, X_WP, l0).total
        theirs = (0.5 * (K + K.T))[rows]
        np.testing.assert_allclose(found.K[k], theirs, atol=SAME * np.abs(K).max())
        scale = np.outer(case.row_scale(), case.row_scale())
        smallest = np.linalg.eigvalsh(theirs / scale)[0]
        assert found.smallest[k] == pytest.approx(smallest, abs=1e-6 * np.abs(K).max())
        first = natural_modes(K, body, X_WP).frequencies[0]
        if found.stable[k]:
            assert frequencies[k] == pytest.approx(first, rel=1e-3)
        else:
            assert np.isnan(frequencies[k])
    assert np.all(np.isnan(found.smallest[~held]))
    assert not np.any(found.stable[~held])


def test_a_high_centre_of_mass_on_one_rope_is_not_stable():
    """A platform that hangs from ropes at its foot falls over where they give way easily."""
    _, case = robot_case("acrobot_large", (0.0, 1e4))
    place = np.array([[0.0, 0.0, 0.3]]), np.eye(3)[None]
    assert stiffness_at(case, *place).stable[0]
    weak = replace(case.cables, stiffness=np.full(8, 1.0))
    high = replace(case, cables=weak, p_PCo=np.array([0.0, 0.0, 5.0]))
    assert not stiffness_at(high, *place).stable[0]


@pytest.mark.parametrize("name", ["acrobot_large", "acrobot_fully_constrained", "planar"])
def test_tension_factors_are_those_of_highs(name):
    robot, case = robot_case(name, (0.2, 60.0))
    positions, rotations = random_poses(robot, 60, seed=2, turn=0.1)
    found = tension_factors(case, positions, rotations)
    held = statically_feasible(case, positions, rotations)
    np.testing.assert_array_equal(np.isfinite(found), held)
    rows = list(case.rows)
    W = wrench_matrices(positions, rotations, case.cables)[:, rows]
    loads = weight_wrenches(case, rotations)[:, rows]
    m = case.cables.count
    for k in np.flatnonzero(held)[:20]:
        # unknowns t / max t, 1 / max t, ratio
        eye, one, zero = np.eye(m), np.ones((m, 1)), np.zeros((m, 1))
        A = np.vstack([
            np.hstack([-eye, zero, one]),
            np.hstack([-eye, 0.2 * one, zero]),
            np.hstack([eye, -60.0 * one, zero]),
        ])  # fmt: skip
        equal = np.column_stack([W[k], loads[k], np.zeros(len(rows))])
        best = linprog(
            [*np.zeros(m + 1), -1.0], A_ub=A, b_ub=np.zeros(3 * m), A_eq=equal,
            b_eq=np.zeros(len(rows)), bounds=[(0, 1)] * m + [(0, None), (0, 1)], method="highs",
        )  # fmt: skip
        assert found[k] == pytest.approx(-best.fun, abs=1e-6)


def test_dexterity_is_the_inverse_condition_number():
    robot, case = robot_case("acrobot_large")
    poses = random_poses(robot, 20)
    found = dexterities(case, *poses)
    numbers = [np.linalg.cond(W) for W in scaled_matrices(case, *poses)]
    np.testing.assert_allclose(found, 1.0 / np.array(numbers), rtol=1e-6)
