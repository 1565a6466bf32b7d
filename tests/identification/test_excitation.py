from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.errors import IdentificationError
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.identification.excitation import ExcitationTask, design_excitation
from cdpr_drake.identification.regressor import inertia_regressor
from cdpr_drake.tensions.methods import exact_tensions
from cdpr_drake.tensions.problem import TensionProblem
from tests.identification.logs import CABLES, ROBOT, G, believed

TASK = ExcitationTask(
    cables=CABLES, inertial=believed().inertial(), gravity=G, start=ROBOT.home.transform(),
    lower=np.array([-0.2, -0.2, 0.15]), upper=np.array([0.2, 0.2, 0.45]), turn=0.35,
    tensions=(3.0, 55.0), cable_speed=0.35, cable_acceleration=10.0, shortest=0.5, size=0.12,
)  # fmt: skip
BETWEEN = 1.02
"""Limits are kept at 16 instants of a stretch; in between they may be passed by as much."""


@pytest.fixture(scope="module")
def excitation():
    return design_excitation(TASK, 6, np.random.default_rng(0))


def test_it_tells_more_than_random_poses(excitation):
    """Standard errors over the same time: half, in the mean of ten."""
    assert excitation.score - excitation.first_score > 2.0 * 10.0 * np.log(1.5)
    assert np.isfinite(excitation.condition)


def test_it_stays_within_the_limits(excitation):
    """By the linear program of the tensions and by cable speeds, at other instants."""
    way = excitation.trajectory
    assert way.pose(0.0).IsNearlyEqualTo(way.pose(way.end_time), 1e-9)
    for t in np.linspace(0.0, way.end_time, 60):
        row = way.motion(t)
        X, V, A = way.pose(t), row[7:13], row[13:]
        J = cable_jacobian(X, CABLES)
        assert np.max(np.abs(J @ V)) < BETWEEN * TASK.cable_speed
        R = X.rotation().matrix()[None]
        F = inertia_regressor(R, V[None], A[None], G)[0] @ TASK.inertial
        low, high = np.full(8, TASK.tensions[0] / 1.2), np.full(8, BETWEEN * TASK.tensions[1])
        assert exact_tensions(TensionProblem(-J.T, -F, low, high)) is not None


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"tensions": (50.0, 55.0)}, "found no pose"),
        ({"turn": 0.0}, "turn: found 0"),
        ({"lower": np.array([0.3, 0.0, 0.2])}, "corners that cross"),
    ],
)
def test_impossible_limits_are_refused(change, words):
    with pytest.raises(IdentificationError, match=words):
        design_excitation(replace(TASK, **change), 3, np.random.default_rng(0))
