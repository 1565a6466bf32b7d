"""Runs of the control by tensions: their numbers, a fall, a stop."""

import numpy as np
import pytest

from cdpr_drake.analyses.studies.tension_methods import trial
from cdpr_drake.analyses.studies.tension_methods.trial import (
    LOST_DISTANCE,
    STEP,
    Applied,
    TensionTrial,
    label_of,
    run_trial,
)
from cdpr_drake.models.robot_loader import load_robot

TRACKING = 1e-6
"""A platform at rest with the exact model stays where it is [m]."""

GRAVITY = 9.81


def spec(method="quadratic_program", **options):
    home = load_robot("caroca_gazebo").home.transform()
    settings = {
        "experiment": "test",
        "robot": "caroca_gazebo",
        "path": (home, home),
        "legs": (1.0,),
        "method": method,
        "stiffness": 100.0,
        "damping": 100.0,
        "duration": 0.2,
    }
    return TensionTrial(**(settings | options))


def test_a_platform_at_rest_stays():
    run = run_trial(spec())
    assert not run["lost"]
    assert run["position_error_max_m"] < TRACKING
    assert run["failures"] == run["negative_tensions"] == 0
    assert run["control_steps"] == pytest.approx(0.2 / STEP, abs=1)
    assert run["tension_min_n"] >= 1.0
    assert run["end_time_s"] == pytest.approx(0.2)
    assert run["times_s"].shape == run["errors_m"].shape == (len(run["tensions_n"]),)
    assert label_of({"method": "a", "kp_per_s2": 1.0, "applied": "cut"}) == "a, Kp 1, cut"


def test_an_offset_asks_for_the_force_that_the_gain_says():
    """The first tensions carry m (g + Kp e)."""
    offset = 0.01
    forces = []
    for gain in (100.0, 400.0):
        run = run_trial(spec(stiffness=gain, offset=(0.0, 0.0, -offset), duration=0.01))
        assert run["position_error_max_m"] == pytest.approx(offset, rel=1e-3)
        robot = load_robot("caroca_gazebo")
        place = robot.home.position - [0.0, 0.0, offset]
        u = robot.exit_points() - (place[:, np.newaxis] + robot.anchor_points())
        forces.append(run["tensions_n"][0] @ (u[2] / np.linalg.norm(u, axis=0)))
    np.testing.assert_allclose(
        forces, [GRAVITY + 100.0 * offset, GRAVITY + 400.0 * offset], rtol=1e-6
    )


def test_what_is_out_of_bounds_falls_held_and_stays_pushed():
    held = run_trial(spec("closed_form", duration=2.0))
    assert held["lost"]
    assert held["failures"] >= held["control_steps"] - 1
    assert held["end_time_s"] < 1.0
    assert held["position_error_max_m"] == pytest.approx(LOST_DISTANCE, rel=0.05)
    pushed = run_trial(spec("closed_form", applied=Applied.PUSHED))
    assert not pushed["lost"]
    assert pushed["tension_min_n"] < 0.0
    assert pushed["negative_tensions"] > 0
    assert pushed["position_error_max_m"] < TRACKING


def test_a_lower_rate_has_fewer_steps():
    run = run_trial(spec(rate=100.0))
    assert run["control_steps"] == pytest.approx(20, abs=1)


def test_what_is_interrupted_is_no_run(monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(trial._Recorder, "__call__", interrupt)
    with pytest.raises(KeyboardInterrupt):
        run_trial(spec())
