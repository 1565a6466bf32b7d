from itertools import combinations, product

import numpy as np
import pytest

from cdpr_drake.calibration.pose_design import LEAST_GAIN, choose_poses, informing_rows
from cdpr_drake.errors import CalibrationError
from tests.calibration.bench import camera_program, true_model


def test_chosen_poses_are_nearly_the_best_of_all_choices():
    random = np.random.default_rng(0)
    rows, known = random.standard_normal((10, 2, 4)), 0.1 * np.eye(4)
    chosen, found = choose_poses(rows, 3, known)
    total = [
        np.linalg.slogdet(known + sum(rows[k].T @ rows[k] for k in some))[1]
        for some in combinations(range(10), 3)
    ]
    assert len(set(chosen)) == 3
    assert found == pytest.approx(max(total), abs=0.05)
    assert found <= max(total) + 1e-12


@pytest.mark.parametrize("seed", range(12))
def test_no_exchange_of_one_chosen_pose_makes_the_choice_better(seed):
    random = np.random.default_rng(seed)
    rows, known = random.standard_normal((30, 2, 8)), 0.01 * np.eye(8)
    chosen, found = choose_poses(rows, 6, known)

    def told(some):
        return np.linalg.slogdet(known + sum(rows[k].T @ rows[k] for k in some))[1]

    assert found == pytest.approx(told(chosen), abs=1e-9)
    for place, other in product(range(6), set(range(30)) - set(chosen)):
        exchanged = chosen.copy()
        exchanged[place] = other
        assert told(exchanged) <= found + 2.0 * LEAST_GAIN


def test_what_poses_tell_adds_up_to_the_information_of_the_program():
    random = np.random.default_rng(1)
    program = camera_program(
        true_model(), true_model(), ["exit_points", "tags"], count=6, random=random
    )
    problem, at = program.least_squares(), program.at()
    rows = informing_rows(problem, at)
    S = problem.normal_equations(at, 0.0).S_data
    np.testing.assert_allclose(np.einsum("krf,krg->fg", rows, rows), S, atol=1e-7 * np.max(S))


def test_more_poses_than_candidates_are_refused():
    with pytest.raises(CalibrationError, match="accepted: 1 to 2"):
        choose_poses(np.ones((2, 1, 1)), 3, np.eye(1))
    with pytest.raises(CalibrationError, match="nothing known"):
        choose_poses(np.ones((2, 1, 1)), 1, np.zeros((1, 1)))
