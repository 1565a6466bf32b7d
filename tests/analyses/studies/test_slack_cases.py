"""Numbers of runs with slack cables, on curves written by hand, and what facts make of them."""

import numpy as np
import pandas as pd
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.studies import case_9, case_10, proposed_cases, slack
from cdpr_drake.analyses.studies.case_9 import (
    CENTERS_MM,
    COMPARED,
    ETAS,
    FINAL_POSE,
    polygon_numbers,
    residual_range,
    simple_way_suffices,
    spikes,
    undisturbed,
)
from cdpr_drake.analyses.studies.case_9_figures import polygon_figure, residual_figure
from cdpr_drake.analyses.studies.experiments import wrong_points
from cdpr_drake.analyses.studies.facts import MissingRuns
from cdpr_drake.analyses.studies.proposed_cases import DISTURBED, WAYS, polygon_is_better
from cdpr_drake.analyses.studies.slack import CORRECTED, PLAIN, TENSIONS, slack_change
from cdpr_drake.analyses.studies.study import Form, study_named
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.geometry.straight_cables import gravity_wrench
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.methods import distribute, solution_space
from tests.figure_faults import figure_faults

POSE = RigidTransform([-0.11, -0.20, 0.366])
"""The printed last position."""

ROUNDING = 1e-9
"""Of residuals of some newtons [N]."""

OFF_PRINTED = 0.1
"""Rounding of table 5.1 and of the printed pose in the length of eta [N]."""

TIME = np.arange(0.0, 4.01, 0.5)


def curves(**changes):
    pulls = np.tile([0.0, 0.0, 5.0], (len(TIME), 1))
    pulls[TIME >= 1.0, 0] = 2.0
    pulls[TIME >= 1.5, 1] = 3.0
    lengths = np.tile([1.0, 1.0, 2.0], (len(TIME), 1))
    lengths[:, 2] -= 0.1 * TIME
    return {
        "time": TIME, "tensions": pulls, "unstrained_lengths": lengths, "stability_time": TIME,
        "jacobian_rank": np.where(TIME < 1.0, 5.0, 6.0),
        "stability_margin": np.where(TIME < 1.0, 0.0, 0.9),
    } | changes  # fmt: skip


def test_the_last_cable_that_pulls_counts():
    assert slack.time_to_taut(curves(), 1.0) == 1.5
    assert slack.time_to_taut(curves(tensions=np.full((len(TIME), 3), 4.0)), 1.0) == 0.0
    assert slack.time_to_taut(curves(tensions=np.zeros((len(TIME), 3))), 1.0) == np.inf
    assert slack.time_to_taut(curves(), 2.5) == np.inf  # C1 stays below


def test_rank_and_margin():
    assert slack.underactuated(curves()) == pytest.approx(1.0)
    assert slack.least_after(curves(), "jacobian_rank", 2.0) == 6.0
    early = curves(stability_margin=np.where(TIME < 2.0, -1.0, 0.9))
    assert slack.least_after(early, "stability_margin", threshold=1.0) == -1.0  # from 1.5 s on
    assert slack.least_after(early, "stability_margin", 2.0) == 0.9
    assert np.isnan(slack.least_after(curves(), "stability_margin", threshold=6.0))
    assert np.isnan(slack.least_after(curves(stability_time=TIME / 10.0), "jacobian_rank", 2.0))


def test_work_chatter_and_travel_of_the_correction():
    assert slack.winch_work(curves()) == pytest.approx(5.0 * 0.1 * 4.0)
    assert slack.cable_power(curves()) == pytest.approx(5.0 * 0.1)
    assert slack.chatter(curves()) == slack.correction_travel(curves()) == 0.0
    swinging = np.ones((len(TIME), 3))
    swinging[::2] = -1.0
    last_second = np.array([-1.0, 1.0, -1.0])
    assert slack.chatter(curves(tensions=swinging)) == pytest.approx(np.std(last_second))
    added = np.full((len(TIME), 3), -0.01)
    assert slack.correction_travel(curves(tension_corrections=added)) == pytest.approx(0.12)


# Case IX.


@pytest.fixture(scope="module")
def problem():
    return tension_problem(load_robot("acrobot_large"), POSE, limits=(1.0, 60.0))


def test_a_residual_is_the_distance_from_the_solutions_and_its_range_holds(problem):
    tensions = np.array(TENSIONS[2])
    residual, least, most = residual_range(problem, tensions, 0.3)
    # Another way: what is left of the balance by the pseudo-inverse of W.
    inverse = np.linalg.pinv(problem.W)
    left = inverse @ (problem.W @ tensions + problem.wrench)
    assert residual == pytest.approx(np.linalg.norm(left), abs=ROUNDING)
    drawn = tensions + np.random.default_rng(0).uniform(-0.3, 0.3, (400, 8))
    off = np.linalg.norm((drawn @ problem.W.T + problem.wrench) @ inverse.T, axis=1)
    assert least <= np.min(off) + ROUNDING
    assert np.max(off) <= most + ROUNDING


def test_tensions_that_balance_have_no_residual_and_no_accuracy_no_range(problem):
    particular, N = solution_space(problem)
    balanced = particular + N @ [1.0, 2.0]
    residual, least, most = residual_range(problem, balanced, 0.3)
    assert max(residual, least) == pytest.approx(0.0, abs=ROUNDING)
    assert most > 0.3
    exact = residual_range(problem, balanced + 1.0, 1e-12)
    np.testing.assert_allclose(exact, exact[0], atol=1e-6)


def test_tensions_in_the_polygon_hold_the_platform_and_others_do_not():
    robot = load_robot("acrobot_large")
    X_WP = robot.home.transform()
    cables = robot.cable_set(pulleys=False)  # as the thesis has them
    held = distribute(
        tension_problem(robot, X_WP, limits=(2.0, 60.0), cables=cables), "barycenter"
    ).tensions
    numbers = polygon_numbers(pose_row(X_WP), held)
    assert numbers["inside"]
    assert numbers["residual_n"] < ROUNDING
    slack_cable = np.where(np.arange(8) == 4, 0.0, held)
    assert not polygon_numbers(pose_row(X_WP), slack_cable)["inside"]


def test_a_spike_rises_above_what_is_beside_it():
    deviation = np.array([0.0, 1.0, 0.0, 0.1, 0.0, 1.0, np.nan, 0.2])
    assert spikes({"image_deviation": deviation}) == 2
    assert spikes({"image_deviation": np.full(3, np.nan)}) == 0


def test_printed_etas_belong_to_the_printed_tensions(monkeypatch):
    """Their norms do at the printed pose; with two cables exchanged most do not."""
    assert all(case_9.norms_of_etas(pd.DataFrame())[0])
    exchanged = {n: (t[2], t[1], t[0], *t[3:]) for n, t in TENSIONS.items()}
    monkeypatch.setattr(case_9, "TENSIONS", exchanged)
    assert sum(case_9.norms_of_etas(pd.DataFrame())[0]) < 5


def row(name, **columns):
    return {"configuration": name, "camera": "projected", "seed": 0, **columns}


def still(name, lengths=1.0):
    arrays = {
        "time": TIME, "unstrained_lengths": np.full((len(TIME), 8), lengths),
        "cable_velocities": np.zeros((len(TIME), 8)),
    }  # fmt: skip
    return row(name, arrays=arrays)


def test_what_the_correction_leaves_alone_is_as_in_e2():
    rows = pd.DataFrame([still("E2"), still("E6"), still("E10", 1.1)])
    held, words = undisturbed(rows)
    assert held == [True, True, False, True]
    assert "E10 at most 100.0 mm" in words
    with pytest.raises(MissingRuns):
        undisturbed(rows[:2])


USUAL = {
    "time_to_taut_s": 1.0, "estimate_max_m": 0.02, "image_max_px": 12.0, "cable_power_w": 1.0,
    "chatter_n": 0.3, "underactuated_s": 0.1, "least_margin_taut": 0.9,
}  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "held"),
    [
        ({}, [True, True]),
        ({"variant_length": {"time_to_taut_s": 0.4}}, [True, False]),
        ({"variant_fast": {"least_margin_taut": -0.1, "chatter_n": 0.1}}, [True, True]),
        ({"E6": {"time_to_taut_s": 5.0}}, [False, False]),
    ],
)
def test_a_simple_way_suffices_if_no_usable_one_is_clearly_better(changes, held):
    rows = pd.DataFrame([row(name, **USUAL | changes.get(name, {})) for name in COMPARED])
    assert simple_way_suffices(rows)[0] == held


def test_figures_need_the_runs_that_they_show():
    names = [f"E{k}" for k in TENSIONS]
    tensions = [{f"C{k + 1}": t for k, t in enumerate(values)} for values in TENSIONS.values()]
    arrays = {"X_WP": np.tile(pose_row(POSE), (3, 1))}
    polygon = {"residual_n": 1.0, "residual_least_n": 0.2, "residual_most_n": 1.5}
    rows = pd.DataFrame(
        row(name, end_tension_n=t, arrays=arrays, polygon=polygon)
        for name, t in zip(names, tensions, strict=True)
    )
    # Four of the printed points are within a newton of each other: their names do not meet.
    assert figure_faults(polygon_figure(rows, {})) == []
    assert residual_figure(rows, {}).axes
    with pytest.raises(MissingRuns):
        polygon_figure(rows[:1], {})


PRINTED = np.array(list(TENSIONS.values()))


def residuals(height):
    """Of the 80 printed tensions, written out: t_p - (1 - N N') t, shape (10, 8) [N], and W."""
    robot = load_robot("acrobot_large")
    A, B = robot.exit_points(), FINAL_POSE.multiply(robot.anchor_points())
    u = (A - B) / np.linalg.norm(A - B, axis=0)
    arms = B - FINAL_POSE.translation()[:, None]
    W = np.vstack([np.cross(arms.T, u.T).T, u])
    center = np.array([0.0, 0.0, height])
    weight = gravity_wrench(FINAL_POSE, robot.platform.mass, center, robot.gravity_vector())
    inverse = np.linalg.pinv(W)
    return -inverse @ weight - PRINTED @ (inverse @ W).T, W


def test_the_height_in_the_file_has_the_least_mean_residual():
    heights = 1e-3 * np.arange(-5.0, 41.0, 2.5)
    mean = [float(np.mean(np.abs(residuals(h)[0]))) for h in heights]
    best = heights[int(np.argmin(mean))]
    for name in ("acrobot_large", "acrobot_fully_constrained"):
        np.testing.assert_allclose(load_robot(name).center_of_mass(), [0.0, 0.0, best], atol=1e-12)
    by_default = mean[int(np.argmin(np.abs(heights - 0.035)))]
    assert min(mean) < 0.5 < 0.7 < by_default
    square = [float(np.sum(residuals(h)[0] ** 2)) for h in heights]
    assert 1e3 * heights[int(np.argmin(square))] == CENTERS_MM[0]


def test_pose_and_points_are_those_of_the_table():
    """|eta| of the ten rows does not depend on the weight, and is as printed."""
    _, _, rows = np.linalg.svd(residuals(0.0)[1])
    norms = np.linalg.norm(PRINTED @ rows[6:].T, axis=1)
    printed = np.linalg.norm(list(ETAS.values()), axis=1)
    np.testing.assert_allclose(norms, printed, atol=OFF_PRINTED)


# Case X.


def test_times_of_c3_and_c7():
    pulls = np.full((len(TIME), 8), 100.0)
    pulls[TIME < 1.5, 6] = 10.0
    pulls[TIME >= 2.0, 2] = 5.0
    c = {"time": TIME, "tensions": pulls}
    assert case_10.first_time(c, 6, below=False) == 1.5
    assert case_10.first_time(c, 2, below=True) == 2.0
    assert case_10.c3_slack(c) == pytest.approx(2.0)
    assert case_10.first_time({"time": TIME, "tensions": 0.0 * pulls}, 6, below=False) == np.inf


def test_the_share_of_a_run_that_is_corrected_counts_until_the_camera_is_there():
    added = np.zeros((len(TIME), 8))
    added[1:3, 4] = -0.01
    path = np.column_stack([np.minimum(TIME, 2.0), np.zeros((len(TIME), 2))])
    share = case_10.correcting_share({"tension_corrections": added, "camera_path": path})
    assert share == pytest.approx(2.0 / 3.0)
    assert case_10.correcting_share({"camera_path": path}) == 0.0


def test_thresholds_of_case_10_are_30_newtons_over_what_slack_cables_read():
    readings = load_robot("caroca").slack_readings
    np.testing.assert_array_equal(case_10.THRESHOLDS, readings + case_10.THRESHOLD)


# What the thesis proposes.


def torque(*pulls):
    c = {"time": 0.1 * np.arange(len(pulls)), "tensions": np.array(pulls, float)}
    return proposed_cases.torque_numbers({**c, "estimate_distance": np.zeros(1)})


def test_slack_counts_from_when_all_cables_pull():
    again = torque([0, 5], [0, 5], [2, 5], [0, 0], [1.5, 4], [1.2, 3])
    assert again["slack_after_s"] == pytest.approx(0.2)  # two cables for a tenth of a second
    assert again["lowest_n"] == 0.0
    assert again["below_after_s"] == pytest.approx(0.1)
    good = torque([0, 5], [2, 5], [3, 4])
    assert good["slack_after_s"] == good["below_after_s"] == 0.0
    never = torque([0, 5], [2, 0])
    assert np.isnan([never[n] for n in ("slack_after_s", "lowest_n", "below_after_s")]).all()


def test_slack_counts_once_however_many_cables_and_errors_where_they_were_seen():
    loose = np.zeros((len(TIME), 3))
    loose[TIME < 1.0, 0] = 0.01
    loose[TIME < 0.5, 1] = 0.02
    assert proposed_cases.slack_share({"time": TIME, "slack": loose}) == pytest.approx(0.25)
    error = np.tile([3.0, -4.0], (len(TIME), 1))
    error[2] = np.nan
    assert proposed_cases.feature_error({"error": error}) == pytest.approx(5.0)


GOOD = {"slack_share": 0.0, "camera_max_m": 3e-3, "chatter_n": 0.1, "cable_power_w": 1.0,
        "image_max_px": 20.0, "outcome": "converged"}  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "held"),
    [
        ({"middle": {"image_max_px": 10.0}}, [True, True]),
        ({}, [True, False]),
        ({"constant": {"image_max_px": 10.0}}, [False, False]),
        ({"middle": {"image_max_px": 10.0, "slack_share": 0.5}}, [True, False]),  # not usable
        ({"middle": {"image_max_px": 10.0, "outcome": "timeout"}}, [True, False]),
    ],
)
def test_a_polygon_is_better_if_it_deviates_less_and_is_usable(changes, held):
    rows = pd.DataFrame(
        row(f"{group}_{way}", **GOOD | changes.get(way, {})) for group in DISTURBED for way in WAYS
    )
    assert polygon_is_better(rows)[0] == held
    with pytest.raises(MissingRuns):
        polygon_is_better(rows[1:])


# All of them.


def test_slack_is_paid_out_on_the_cables_that_are_named_and_points_are_believed_wrongly():
    assert slack_change(6, (2, 7)) == "perturbations.slack=[0, 0.06, 0, 0, 0, 0, 0.06, 0]"
    for name, cables in (("case-9", (1, 2)), ("case-10", (2, 7))):
        cases = study_named(name).cases(Form(quick=True))
        changes = {case.keys["configuration"]: case.call.args[1] for case in cases}
        for k, pair in enumerate(zip(PLAIN, CORRECTED, strict=True)):
            assert all(slack_change(2 * k, cables) in changes[one] for one in pair)
    for name in ("case-9", "case-9-torque"):
        for case in study_named(name).cases(Form(quick=True)):
            assert set(wrong_points()) <= set(case.call.args[1])
