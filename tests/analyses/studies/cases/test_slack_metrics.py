"""What is said of slack cables, on traces written by hand."""

import numpy as np
import pytest

from cdpr_drake.analyses.studies.cases import case_9
from cdpr_drake.analyses.studies.cases.case_9 import CASE_9, in_polygon
from cdpr_drake.analyses.studies.cases.run import CaseJob, CaseRun, CaseRuns
from cdpr_drake.analyses.studies.cases.slack_metrics import (
    chatter,
    correction_travel,
    feature_error,
    least_margin_late,
    least_rank_late,
    mean_power,
    slack_time,
    time_to_taut,
    underactuated_time,
    winch_work,
)
from cdpr_drake.models import load_robot, tension_problem
from cdpr_drake.spatial import pose_row
from cdpr_drake.tensions import distribute

TIME = np.arange(0.0, 4.01, 0.5)


def traces(**changes):
    pulls = np.tile([0.0, 0.0, 5.0], (len(TIME), 1))
    pulls[TIME >= 1.0, 0] = 2.0
    pulls[TIME >= 1.5, 1] = 3.0
    lengths = np.tile([1.0, 1.0, 2.0], (len(TIME), 1))
    lengths[:, 2] -= 0.1 * TIME
    found = {
        "time": TIME,
        "tensions": pulls,
        "unstrained_lengths": lengths,
        "stability_time": TIME,
        "jacobian_rank": np.where(TIME < 1.0, 5.0, 6.0),
        "stability_margin": np.where(TIME < 1.0, 0.0, 0.9),
    }
    return found | changes


def test_the_last_cable_counts():
    assert time_to_taut(traces()) == 1.5
    assert time_to_taut(traces(tensions=np.full((len(TIME), 3), 4.0))) == 0.0
    assert time_to_taut(traces(tensions=np.zeros((len(TIME), 3)))) == np.inf


def test_rank_and_margin():
    assert underactuated_time(traces()) == pytest.approx(1.0)
    assert least_rank_late(traces()) == 6.0
    assert least_margin_late(traces()) == 0.9
    late = np.where(TIME == 3.0, 4.0, 6.0)
    assert least_rank_late(traces(jacobian_rank=late)) == 4.0
    assert np.isnan(least_rank_late(traces(stability_time=TIME / 10.0)))


def test_work_and_chatter():
    assert winch_work(traces()) == pytest.approx(5.0 * 0.1 * 4.0)
    assert chatter(traces()) == 0.0
    swinging = np.ones((len(TIME), 3))
    swinging[::2] = -1.0
    n = np.array([-1.0, 1.0, -1.0])  # of the last second
    assert chatter(traces(tensions=swinging)) == pytest.approx(np.std(n))


def test_travel_of_the_correction():
    assert correction_travel(traces()) == 0.0
    added = np.full((len(TIME), 3), -0.01)
    assert correction_travel(traces(tension_corrections=added)) == pytest.approx(3 * 0.01 * 4.0)


def test_tensions_that_hold_the_platform_have_no_residual_and_others_do():
    robot = load_robot("acrobot_large")
    X_WP = robot.home.transform()
    problem = tension_problem(robot, X_WP, limits=(2.0, 60.0))
    held = distribute(problem, "barycenter").tensions
    inside, _, residual = in_polygon(pose_row(X_WP), held)
    assert inside
    assert residual < 1e-9
    inside, _, residual = in_polygon(pose_row(X_WP), held + np.eye(8)[0])
    assert 0.0 < residual < 1.0  # what of a newton in one cable balances no weight
    slack = held.copy()
    slack[4] = 0.0
    assert not in_polygon(pose_row(X_WP), slack)[0]


def run(name, **metrics):
    job = CaseJob(name, "acrobot_slack_start", (), 0, False)
    numbers = {**dict.fromkeys(CASE_9.metrics(), 0.0), **metrics}
    return CaseRun(
        job=job, outcome="timeout", message="", metrics=numbers, summary={}, traces={},
        features=(), stop_position=0.0,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("times", "verdict"),
    [
        ((0.5, 0.9, 1.8), "confirmed"),
        ((0.5, 0.9, 8.0), "in part"),
        ((9.0, 9.0, 9.0), "not confirmed"),
    ],
)
def test_a_published_time_is_met_or_not(times, verdict):
    runs = CaseRuns(
        run(name, time_to_taut_s=time)
        for name, time in zip(("E4", "E6", "E10"), times, strict=True)
    )
    assert case_9._gone(runs).verdict == verdict


@pytest.mark.parametrize(
    ("times", "verdict"),
    [
        ((2.0, 2.5, 3.0, 4.0), "confirmed"),
        ((0.5, 0.6, 0.7, 0.8), "in part"),
        ((4.0, 3.0, 2.0, 1.0), "not confirmed"),
    ],
)
def test_underactuation_grows_or_not(times, verdict):
    runs = CaseRuns(
        run(name, underactuated_s=time)
        for name, time in zip(("E3", "E5", "E7", "E9"), times, strict=True)
    )
    assert case_9._underactuated(runs).verdict == verdict


@pytest.mark.parametrize(("rank", "verdict"), [(6.0, "confirmed"), (5.0, "not confirmed")])
def test_stable_means_in_every_run(rank, verdict):
    runs = CaseRuns(
        run(name, least_rank_late=rank, least_margin_late=0.9 if rank == 6.0 else 0.0)
        for name in ("E2", "E4", "E6", "E8", "E10")
    )
    assert case_9._stable(runs).verdict == verdict


def test_slack_counts_once_however_many_cables():
    slack = np.zeros((len(TIME), 3))
    slack[TIME < 1.0, 0] = 0.01
    slack[TIME < 0.5, 1] = 0.02
    assert slack_time(traces(slack=slack)) == pytest.approx(0.25)


def test_power_is_work_over_time():
    assert mean_power(traces()) == pytest.approx(winch_work(traces()) / 4.0)


def test_the_feature_error_leaves_out_what_was_not_seen():
    error = np.tile([3.0, -4.0], (len(TIME), 1))
    error[2] = np.nan
    assert feature_error(traces(error=error)) == pytest.approx(5.0)
