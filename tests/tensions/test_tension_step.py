"""The kernel of one control step agrees with the functions that it is made of."""

import numpy as np
import pytest
from scipy.optimize import linprog

from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.straight_cables import PLANAR_ROWS
from cdpr_drake.models.robot_in_plant import pose_from_state
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.tensions.batch import distribute_batch
from cdpr_drake.tensions.closed_form_kernel import NOT_FOUND
from cdpr_drake.tensions.control_step_kernel import update_tensions, wrench_matrix_at
from cdpr_drake.tensions.methods import METHODS
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE, INFEASIBLE, workspace_shape

TIGHT = 0.6  # [N] at most, where 0.5 N are the least: nothing balances

ROUNDING = 1e-13
"""Two ways to write the same sums of numbers around one."""


def random_state(robot, random):
    if robot.is_planar():
        return np.concatenate([random.uniform(-0.2, 0.2, 3), random.normal(size=3)])
    q = np.array([1.0, *random.uniform(-0.1, 0.1, 3)])
    return np.concatenate([q, [0.05, 0.1, 0.4], random.normal(size=6)])


@pytest.mark.parametrize("moments", [True, False])
@pytest.mark.parametrize("pulleys", [True, False])
@pytest.mark.parametrize("name", ["acrobot_large", "caroca", "planar"])
def test_wrench_matrix_and_tensions(name, pulleys, moments):
    """Of the whole wrench, and of its force alone."""
    robot, random = load_robot(name), np.random.default_rng(3)
    rows = list(PLANAR_ROWS) if robot.is_planar() else list(range(6))
    rows = rows if moments else [row for row in rows if row > 2]
    n, m = len(rows), len(robot.cables)
    height = robot.plane_height or 0.0
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    bounds = np.vstack([np.full(m, 0.5), np.full(m, 5000.0), np.zeros(m)])
    held_at_all = []
    for number in range(10):
        state = random_state(robot, random)
        W = np.empty((n, m))
        wrench_matrix_at(state, cables.packed(), height, W)
        X_WP = pose_from_state(robot, state)
        expected = -cable_paths(X_WP, cables).J.T[rows]
        np.testing.assert_allclose(W, expected, atol=ROUNDING)
        desired = np.concatenate([random.normal(size=3) * 0.1, [0.0, 0.0, 200.0]])
        bounds[1] = TIGHT if number % 2 else 5000.0
        limits = list(zip(bounds[0], bounds[1], strict=True))
        holds = linprog(np.ones(m), A_eq=W, b_eq=desired[rows], bounds=limits).success
        held_at_all.append(holds)
        for name, method in METHODS.items():
            if not method.takes(m - n):
                continue
            t, held, feasible = np.empty(m), np.full(m, 7.0), np.full(1, np.nan)
            code = update_tensions(
                method.compiled(m - n), state, desired, cables.packed(), height, bounds, np.ones(n),
                np.empty(workspace_shape(n, m)), np.empty((n, m)), t, held, feasible,
            )  # fmt: skip
            many, codes = distribute_batch(
                W[None], -desired[rows][None], bounds[0], bounds[1], name, bounds[2]
            )
            # A verdict of missed is looked into by the batch only.
            assert code == codes[0] or (code == NOT_FOUND and codes[0] == INFEASIBLE)
            assert codes[0] == (FEASIBLE if holds else INFEASIBLE) or (
                codes[0] == NOT_FOUND and holds and not method.exact
            )
            assert feasible[0] == (code == FEASIBLE)
            if code == FEASIBLE:
                np.testing.assert_allclose(t, many[0], rtol=1e-10)
                np.testing.assert_allclose(W @ t, desired[rows], atol=1e-9 * 200.0)
            if code == FEASIBLE or (code == INFEASIBLE and method.relaxes):
                np.testing.assert_array_equal(held, t)
            else:
                np.testing.assert_array_equal(held, 7.0)
    assert 0 < sum(held_at_all) < 10
