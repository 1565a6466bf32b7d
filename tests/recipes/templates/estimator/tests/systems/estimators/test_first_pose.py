"""The toy estimator alone, and in a run by either loop."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

import cdpr_drake as cdpr
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.estimators.first_pose import FirstPose
from tests.systems.estimators.estimator_bench import RATE, EstimatorBench

QUICK = ["camera.kind=projected", "duration=0.2", "estimator.kind=first_pose"]


ROUNDING = 1e-12
"""Of a pose that is kept as a quaternion [-, m]."""


def test_it_stays():
    X_WP0 = RigidTransform([0.1, 0.2, 0.3])
    bench = EstimatorBench(FirstPose(X_WP0, RATE, np.zeros(0)))
    assert all(bench.step().IsExactlyEqualTo(X_WP0) for _ in range(3))


def test_a_run():
    believed = ServoRun(cdpr.load_scenario("acrobot_pbvs", QUICK)).simulate().log["X_WP_estimated"]
    np.testing.assert_allclose(believed, np.tile(believed[0], (len(believed), 1)), atol=ROUNDING)


def test_the_refusal_of_others_names_it():
    with pytest.raises(ScenarioError, match=r"estimator\.kind: found nothing.*first_pose"):
        cdpr.load_scenario("acrobot_pbvs", ["estimator.kind=nothing"])
