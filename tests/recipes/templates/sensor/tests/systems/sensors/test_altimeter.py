"""The toy sensor: wrong by what its type says, the same by the same seed, logged by a run."""

import numpy as np
from pydrake.math import RigidTransform

import cdpr_drake as cdpr
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.systems.sensors.altimeter import Altimeter, AltimeterModel

QUICK = ["camera.kind=projected", "duration=0.2", "sensors.log=[altimeter]"]

ONE_PERIOD = 5e-3
"""What the platform rises in a period of the sensor, and the sensor's error, at most [m]."""


def test_it_is_wrong_by_a_seed():
    model = AltimeterModel()
    errors = [Altimeter(model, seed, 50.0).error for seed in range(20)]
    assert 0.0 < np.std(errors) <= np.max(np.abs(errors)) <= model.accuracy
    assert Altimeter(model, 3, 50.0).error == errors[3]
    read = Altimeter(model, 3, 50.0).measure(RigidTransform([1.0, 2.0, 3.0]), 1)
    np.testing.assert_array_equal(read, [3.0 + errors[3]])


def test_a_run_logs_it():
    run = ServoRun(cdpr.load_scenario("acrobot_pbvs", QUICK)).simulate()
    log = run.log
    heights = log["measured_height"][2:, 0]
    assert np.max(np.abs(heights - log["X_WP"][2:, 6])) < ONE_PERIOD
    assert "measured_height.0" in run.columns()
