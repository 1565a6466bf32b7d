"""The study of fusion: what is drawn by a seed, and what it says of made-up runs."""

import numpy as np
import pandas as pd
import pytest

from cdpr_drake.analyses.studies.facts import MissingRuns
from cdpr_drake.analyses.studies.fusion import (
    CONFIGURATIONS,
    both_as_good_as_the_better,
    consistent,
    normalized_errors,
    servo_scenario,
)


def test_what_is_wrong_is_drawn_by_seed_and_every_configuration_loads():
    starts = [
        servo_scenario((), 1.0, seed).perturbations.initial_pose.position for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(starts[0], starts[1])
    assert np.linalg.norm(starts[0] - starts[2]) > 1e-4
    for _, changes in CONFIGURATIONS.values():
        servo_scenario(changes, 12.0, 0)


def test_errors_are_counted_in_deviations():
    pose = np.array([1.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.3])
    off = np.array([1.0, 0.0, 0.0, 0.0, 0.12, 0.2, 0.3])
    log = {
        "time": np.arange(2), "X_WP": np.array([pose, off]), "X_WP_estimated": np.array([pose] * 2),
        "fusion_covariance": np.tile(0.01**2 * np.eye(6).ravel(), (2, 1)),
    }  # fmt: skip
    np.testing.assert_allclose(normalized_errors(log), [np.nan, 4.0])


def runs(both=(4e-3, 4e-3), nees=6.0):
    """Two seeds of every configuration, the camera in the world as good as that on board."""
    return pd.DataFrame([
        {"configuration": name, "expected_m": 4e-3, "nees": nees,
         "mean_m": both[seed] if name == "both" else 4e-3}
        for name in CONFIGURATIONS for seed in (0, 1)
    ])  # fmt: skip


@pytest.mark.parametrize(
    ("both", "held"),
    [((3e-3, 5e-3), [True, True]), ((3e-3, 6e-3), [False, True]), ((5e-3, 5e-3), [False, False])],
)
def test_two_cameras_are_compared_with_the_better_one(both, held):
    assert both_as_good_as_the_better(runs(both))[0] == held


def test_one_seed_has_no_spread():
    with pytest.raises(MissingRuns, match="second seed"):
        both_as_good_as_the_better(runs()[::2])


def test_a_filter_may_be_too_sure_or_too_doubtful():
    assert all(consistent(runs())[0])
    assert not any(consistent(runs(nees=60.0))[0])
    assert all(consistent(runs(nees=15.0))[0])  # two runs tell so little
