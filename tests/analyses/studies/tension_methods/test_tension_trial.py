"""Runs of the control by tensions: their numbers, a fall, a stop."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.studies.tension_methods import trial
from cdpr_drake.analyses.studies.tension_methods.trial import (
    LOST_DISTANCE,
    STEP,
    Applied,
    TensionTrial,
    run_trial,
)
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

TRACKING = 1e-6
"""A platform at rest with the exact model stays where it is [m]."""

GRAVITY = 9.81


def spec(method="quadratic_program", **options):
    home = load_robot("caroca_gazebo").home.transform()
    settings = {
        "experiment": "test",
        "robot": "caroca_gazebo",
        "trajectory": PoseTrajectory((home, home), (1.0,)),
        "method": method,
        "stiffness": 100.0,
        "damping": 100.0,
        "duration": 0.2,
    }
    return TensionTrial(**(settings | options))


def test_a_platform_at_rest_stays():
    run = run_trial(spec())
    assert not run.lost
    assert run.largest_error < TRACKING
    assert run.failures == run.negative_tensions == 0
    assert run.steps == pytest.approx(0.2 / STEP, abs=1)
    assert run.smallest_tension >= 1.0
    assert run.end_time == pytest.approx(0.2)
    assert run.times.shape == run.errors.shape == (len(run.tensions),)
    json.dumps(run.as_dict(), allow_nan=False)


def test_an_offset_asks_for_the_force_that_the_gain_says():
    """The first tensions carry m (g + Kp e)."""
    offset = 0.01
    forces = []
    for gain in (100.0, 400.0):
        run = run_trial(spec(stiffness=gain, offset=(0.0, 0.0, -offset), duration=0.01))
        assert run.largest_error == pytest.approx(offset, rel=1e-3)
        robot = load_robot("caroca_gazebo")
        place = robot.home.position - [0.0, 0.0, offset]
        u = robot.exit_points() - (place[:, np.newaxis] + robot.anchor_points())
        forces.append(run.tensions[0] @ (u[2] / np.linalg.norm(u, axis=0)))
    np.testing.assert_allclose(
        forces, [GRAVITY + 100.0 * offset, GRAVITY + 400.0 * offset], rtol=1e-6
    )


def test_what_is_out_of_bounds_falls_held_and_stays_pushed():
    held = run_trial(spec("closed_form", duration=2.0))
    assert held.lost
    assert held.failures >= held.steps - 1
    assert held.end_time < 1.0
    assert held.largest_error == pytest.approx(LOST_DISTANCE, rel=0.05)
    pushed = run_trial(spec("closed_form", applied=Applied.PUSHED))
    assert not pushed.lost
    assert pushed.smallest_tension < 0.0
    assert pushed.negative_tensions > 0
    assert pushed.largest_error < TRACKING


def test_a_lower_rate_has_fewer_steps():
    run = run_trial(spec(rate=100.0))
    assert run.steps == pytest.approx(20, abs=1)


def test_what_is_interrupted_is_no_run(monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(trial._Recorder, "__call__", interrupt)
    with pytest.raises(KeyboardInterrupt):
        run_trial(spec())
