"""Runs that start beside their path, or whose forces act a tenth of the time."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.studies.tension_methods import start_experiments as planned
from cdpr_drake.analyses.studies.tension_methods.start_trial import (
    NOTHING,
    STATIC,
    StartTrial,
    run_start_trial,
)
from cdpr_drake.analyses.studies.tension_methods.trial import Applied
from cdpr_drake.control.force_balance import FORCE, WRENCH
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.geometry.straight_cables import wrench_matrix
from cdpr_drake.models.robot_loader import load_robot

GRAVITY = 9.81

ROUNDING = 1e-9
"""Of forces of some ten newtons [N]."""

MEAN = 0.03
"""What the mean of a period of 10 ms leaves out, and a start that has not quite died out."""

HOME = np.array(load_robot("caroca_gazebo").home.position)


def spec(**changes):
    settings = {
        "experiment": planned.START_ERROR,
        "robot": "caroca_gazebo",
        "path": (HOME, HOME),
        "leg": 1.0,
        "method": "quadratic_program",
        "gain": 100.0,
        "applied": Applied.HELD,
        "balance": WRENCH,
        "rate": 1000.0,
        "start": "somewhere",
        "position": HOME - [0.0, 0.0, 0.1],
        "duration": 0.2,
    }
    return StartTrial(**(settings | changes))


@pytest.mark.parametrize("balance", [WRENCH, FORCE])
@pytest.mark.parametrize(
    ("method", "applied"), [("quadratic_program", Applied.HELD), ("pseudo_inverse", Applied.PUSHED)]
)
def test_the_first_tensions_are_gain_times_start_error(balance, method, applied):
    """1 kg that starts 0.1 m below its goal at gain 100: 9.81 N and 10 N, upwards."""
    run = run_start_trial(spec(balance=balance, method=method, applied=applied))
    assert run["start_error_m"] == pytest.approx(0.1)
    robot = load_robot("caroca_gazebo")
    X_WP = pose_from_angles(HOME - [0.0, 0.0, 0.1], np.zeros(3))
    W = wrench_matrix(X_WP, robot.exit_points(), robot.anchor_points())
    force = np.array([0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY + 10.0])
    rows = slice(3 if balance == FORCE else 0, 6)
    least = np.linalg.pinv(W[rows]) @ force[rows]  # within the bounds here, so of both methods
    assert least.min() > 1.0
    assert run["tension_first_max_n"] == pytest.approx(np.max(least), abs=ROUNDING)
    assert run["tension_max_n"] >= run["tension_first_max_n"]
    assert run["control_steps"] == 200
    assert not run["lost"]


def test_the_error_dies_out_by_the_wrench():
    """The slow mode at Kp = Kd = 100 has a time constant of 1 s."""
    run = run_start_trial(spec(duration=6.0))
    assert run["position_error_last_tenth_m"] == pytest.approx(0.1 * np.exp(-5.7), rel=0.1)
    assert run["turn_max_rad"] < 1e-3


def test_by_forces_alone_the_platform_turns():
    assert run_start_trial(spec(balance=FORCE))["turn_max_rad"] > 1e-2


def test_forces_that_act_a_tenth_of_the_time_are_ten_times_as_large():
    """In the balance of a mean: error and speed carry the other nine tenths of the weight.

    From pulse to pulse the speed goes from -v to v and back, v = 9 g 1 ms / 2; it is read at -v.
    """
    pulsed = spec(
        rate=100.0, between=NOTHING, gain=400.0, method="pseudo_inverse", applied=Applied.PUSHED,
        position=HOME, duration=6.0,
    )  # fmt: skip
    run = run_start_trial(pulsed)
    sag = (9.0 * GRAVITY - 400.0 * 4.5e-3 * GRAVITY) / 400.0
    assert run["position_error_last_tenth_m"] == pytest.approx(sag, rel=MEAN)
    robot = load_robot("caroca_gazebo")
    X_WP = pose_from_angles(HOME - [0.0, 0.0, sag], np.zeros(3))
    W = wrench_matrix(X_WP, robot.exit_points(), robot.anchor_points())
    ten = np.linalg.pinv(W) @ [0.0, 0.0, 0.0, 0.0, 0.0, 10.0 * GRAVITY]
    assert run["tension_last_max_n"] == pytest.approx(np.max(ten), rel=MEAN)
    assert run["control_steps"] == 600


def test_tensions_of_rest_leave_nothing_to_do_at_home():
    pulsed = spec(rate=100.0, between=STATIC, balance=FORCE, position=HOME, duration=0.05)
    robot = load_robot("caroca_gazebo")
    W = wrench_matrix(robot.home.transform(), robot.exit_points(), robot.anchor_points())
    resting = pulsed.resting_tensions(robot)
    np.testing.assert_allclose(W[3:] @ resting, [0.0, 0.0, GRAVITY], atol=ROUNDING)
    np.testing.assert_array_equal(
        replace(pulsed, between=NOTHING).resting_tensions(robot), np.zeros(8)
    )


def test_a_platform_that_nothing_holds_is_lost():
    """Unchecked tensions that a cable cannot have: closed form within bounds that it leaves."""
    run = run_start_trial(spec(method="closed_form", duration=5.0))
    assert run["lost"]
    assert run["tension_last_max_n"] is None
    assert run["end_time_s"] < 5.0


def test_the_plan_is_what_was_written_before():
    specs = planned.start_trials(quick=False)
    some = [one for one in specs if one.experiment == planned.START_ERROR]
    made = {(one.method, one.gain, one.start, one.rate, one.balance, one.duration) for one in some}
    assert made == {
        (method, gain, start, rate, balance, 100.0)
        for method in planned.PRINTED
        for gain in planned.GAINS
        for start in ("0.3 m", "0.4 m", "0.5 m", "0.6 m", planned.LAUNCH)
        for rate in planned.RATES
        for balance in (WRENCH, FORCE)
    }
    pulses = [one for one in specs if one.between]
    assert {(one.start, one.between) for one in pulses} == {
        (start, between)
        for start in (planned.ON_PATH, planned.LAUNCH)
        for between in (NOTHING, STATIC)
    }
    assert {(one.balance, one.rate) for one in pulses} == {(FORCE, 100.0)}
    assert len({one.name() for one in specs}) == len(specs)
    for one in some:
        if one.start != planned.LAUNCH:
            assert one.start_error() == pytest.approx(float(one.start.split()[0]))
        way = np.cross(one.position - one.path[0], HOME - one.path[0])
        np.testing.assert_allclose(way, np.zeros(3), atol=1e-12)
    assert planned.ERRORS == (0.3, 0.4, 0.5, 0.6)
    np.testing.assert_allclose(planned.path_of("closed_form")[0], [0.0, -2.0, 1.8])


def test_the_short_form_is_short():
    specs = planned.start_trials(quick=True)
    assert len(specs) == 12
    assert {one.duration for one in specs} == {planned.QUICK_TIME}
