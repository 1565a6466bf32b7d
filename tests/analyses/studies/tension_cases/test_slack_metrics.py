"""What is said of slack cables, on traces written by hand."""

import numpy as np
import pytest

from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.tension_cases import case_9_statements as case_9
from cdpr_drake.analyses.studies.tension_cases import case_10_statements as case_10
from cdpr_drake.analyses.studies.tension_cases.case_9 import STUDY as CASE_9
from cdpr_drake.analyses.studies.tension_cases.case_9 import stiffness
from cdpr_drake.analyses.studies.tension_cases.case_9_statements import in_polygon
from cdpr_drake.analyses.studies.tension_cases.case_10 import STUDY as CASE_10
from cdpr_drake.analyses.studies.tension_cases.slack_experiments import (
    CORRECTED,
    PLAIN,
    slack_change,
)
from cdpr_drake.analyses.studies.tension_cases.slack_metrics import (
    cable_power,
    chatter,
    correction_travel,
    feature_error,
    least_margin_late,
    least_margin_taut,
    least_rank_late,
    slack_time,
    time_to_taut,
    underactuated_time,
    winch_work,
)
from cdpr_drake.analyses.studies.tension_cases.slack_variants import COMPARED, advice, which_to_take
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.methods import distribute
from tests.analyses.studies.made_runs import made_run, made_runs

TIME = np.arange(0.0, 4.01, 0.5)


def traces(**changes):
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


def test_the_last_cable_counts():
    assert time_to_taut(traces(), 1.0) == 1.5
    assert time_to_taut(traces(tensions=np.full((len(TIME), 3), 4.0)), 1.0) == 0.0
    assert time_to_taut(traces(tensions=np.zeros((len(TIME), 3))), 1.0) == np.inf
    assert time_to_taut(traces(), 2.5) == np.inf  # C1 stays below
    assert time_to_taut(traces(), 6.0) == np.inf


def test_rank_and_margin():
    assert underactuated_time(traces()) == pytest.approx(1.0)
    assert least_rank_late(traces()) == 6.0
    assert least_margin_late(traces()) == 0.9
    assert least_margin_taut(traces(), 1.0) == 0.9
    early = np.where(TIME < 2.0, -1.0, 0.9)
    assert least_margin_taut(traces(stability_margin=early), 1.0) == -1.0  # from 1.5 s on
    assert least_margin_late(traces(stability_margin=early)) == 0.9
    assert np.isnan(least_margin_taut(traces(), 6.0))
    late = np.where(TIME == 3.0, 4.0, 6.0)
    assert least_rank_late(traces(jacobian_rank=late)) == 4.0
    assert np.isnan(least_rank_late(traces(stability_time=TIME / 10.0)))


def test_work_chatter_and_travel_of_the_correction():
    assert winch_work(traces()) == pytest.approx(5.0 * 0.1 * 4.0)
    assert cable_power(traces()) == pytest.approx(5.0 * 0.1)
    assert chatter(traces()) == correction_travel(traces()) == 0.0
    swinging = np.ones((len(TIME), 3))
    swinging[::2] = -1.0
    n = np.array([-1.0, 1.0, -1.0])  # of the last second
    assert chatter(traces(tensions=swinging)) == pytest.approx(np.std(n))
    added = np.full((len(TIME), 3), -0.01)
    assert correction_travel(traces(tension_corrections=added)) == pytest.approx(3 * 0.01 * 4.0)


def test_slack_counts_once_however_many_cables_and_errors_where_they_were_seen():
    slack = np.zeros((len(TIME), 3))
    slack[TIME < 1.0, 0] = 0.01
    slack[TIME < 0.5, 1] = 0.02
    assert slack_time(traces(slack=slack)) == pytest.approx(0.25)
    error = np.tile([3.0, -4.0], (len(TIME), 1))
    error[2] = np.nan
    assert feature_error(traces(error=error)) == pytest.approx(5.0)


def test_tensions_that_hold_the_platform_have_no_residual_and_others_do():
    robot = load_robot("acrobot_large")
    X_WP = robot.home.transform()
    cables = robot.cable_set(pulleys=False)  # as the thesis has them
    problem = tension_problem(robot, X_WP, limits=(2.0, 60.0), cables=cables)
    held = distribute(problem, "barycenter").tensions
    inside, _, residual = in_polygon(pose_row(X_WP), held)
    assert inside
    assert residual < 1e-9
    inside, _, residual = in_polygon(pose_row(X_WP), held + np.eye(8)[0])
    assert 0.0 < residual < 1.0  # what of a newton in one cable balances no weight
    slack = held.copy()
    slack[4] = 0.0
    assert not in_polygon(pose_row(X_WP), slack)[0]


def test_printed_etas_belong_to_the_printed_tensions(monkeypatch):
    """Their norms do at the printed pose; with two cables exchanged most do not."""
    assert case_9.eta.judge(Runs([], list)).verdict_words == "confirmed"
    exchanged = {n: (t[2], t[1], t[0], *t[3:]) for n, t in case_9.PUBLISHED_TENSIONS.items()}
    monkeypatch.setattr(case_9, "PUBLISHED_TENSIONS", exchanged)
    assert case_9.eta.judge(Runs([], list)).held < 5


def run(name, outcome="timeout", seed=0, traces=None, case=CASE_9, **metrics):
    row = {**metrics, **(traces or {}), "summary": {"robot": "acrobot_large"}}
    return made_run(name, outcome, seed, case.cases.metrics(), **row)


TAUT, LOOSE, RANK = "time_to_taut_s", "underactuated_s", "least_rank_late"
GROWING = ("E3", "E5", "E7", "E9")


@pytest.mark.parametrize(
    ("judge", "names", "column", "values", "verdict"),
    [
        (case_9.gone, ("E4", "E6", "E10"), TAUT, (0.5, 0.9, 1.8), "met (fitted)"),
        (case_9.gone, ("E4", "E6", "E10"), TAUT, (0.5, 0.9, 8.0), "in part"),
        (case_9.gone, ("E4", "E6", "E10"), TAUT, (9.0, 9.0, 9.0), "not confirmed"),
        (case_9.underactuated, GROWING, LOOSE, (2.0, 2.5, 3.0, 4.0), "met (fitted)"),
        (case_9.underactuated, GROWING, LOOSE, (0.5, 0.6, 0.7, 0.8), "in part"),
        (case_9.underactuated, GROWING, LOOSE, (4.0, 3.0, 2.0, 1.0), "not confirmed"),
        (case_9.rank_kept, CORRECTED, RANK, [6.0] * len(CORRECTED), "confirmed"),
        (case_9.rank_kept, CORRECTED, RANK, [5.0] * len(CORRECTED), "not confirmed"),
    ],
)
def test_what_is_published_of_slack_is_met_or_not(judge, names, column, values, verdict):
    runs = [run(name, **{column: value}) for name, value in zip(names, values, strict=True)]
    assert judge.judge(made_runs(runs)).verdict == verdict


def test_a_margin_that_is_lost_before_slack_is_gone_is_told_apart_and_explained():
    """At 2 s C2 and C6 are below a newton; the others are judged by their own Jacobian."""
    X_WP = pose_row(load_robot("acrobot_large").home.transform())
    pulls = np.full((len(TIME), 8), 5.0)
    pulls[TIME == 2.0, [[1], [5]]] = 0.5
    worst = {
        "time": TIME,
        "tensions": pulls,
        "stability_time": TIME,
        "stability_margin": np.where(TIME == 2.0, -1.7, 0.9),
        "X_WP": np.tile(X_WP, (len(TIME), 1)),
    }
    runs = made_runs(
        run(name, traces=worst, seed=3, least_margin_taut=0.9, least_margin_late=late)
        for name, late in zip(CORRECTED, (0.9, 0.9, 0.9, 0.9, -1.7), strict=True)
    )
    found = case_9.stable.judge(runs)
    assert found.verdict == "in part"
    assert "gone 0.90; after 2 s -1.70: E10, seed 3, at 2.00 s, without C2 and C6" in found.found
    good = made_runs(
        run(name, traces=worst, least_margin_taut=0.9, least_margin_late=0.9) for name in CORRECTED
    )
    assert case_9.stable.judge(good).verdict == "confirmed"


def test_a_short_form_judges_what_it_has_and_says_nothing_of_the_rest():
    runs = made_runs([run("E6", time_to_taut_s=0.9), run("E5", underactuated_s=2.0)])
    assert case_9.gone.judge(runs).found == "4 cm 0.90 s"
    for judge in (case_9.underactuated, case_9.image, stiffness, case_10.growing):
        with pytest.raises(MissingRuns):
            judge.judge(runs)
    with pytest.raises(MissingRuns):
        advice.judge(made_runs([run("E5")]))


def ways(**changes):
    usual = {
        "time_to_taut_s": 1.0, "estimate_max_m": 0.02, "image_max_px": 12.0, "cable_power_w": 1.0,
        "chatter_n": 0.3, "least_margin_taut": 0.9,
    }  # fmt: skip
    return made_runs(run(name, **usual | changes.get(name, {})) for name in COMPARED)


def cells(table, row):
    return [list(column.cells)[row] for column in table.columns]


def test_the_table_of_ways_says_which_are_usable_and_stars_the_best():
    runs = ways(
        E5={"time_to_taut_s": 3.0, "cable_power_w": 0.5},
        variant_length={"time_to_taut_s": 0.4},
        variant_fast={"least_margin_taut": -0.1, "chatter_n": 0.1},
    )
    table = which_to_take(runs)
    assert len(table.rows) == len(COMPARED)
    names = list(COMPARED)
    none = cells(table, names.index("E5"))
    assert none[1] == "no"
    assert "0.50" in none  # without a star, though the least power
    assert "0.40*" in cells(table, names.index("variant_length"))
    assert cells(table, names.index("variant_fast"))[1] == "no"
    said = advice.judge(runs)
    assert said.verdict == "in part"  # the simple one is usable, and another is clearly better
    assert "slack gone" in said.why
    assert advice.judge(ways()).verdict == "confirmed"
    assert advice.judge(ways(E6={"time_to_taut_s": 5.0})).verdict == "not confirmed"


def test_slack_is_paid_out_on_the_cables_that_are_named():
    assert slack_change(6, (2, 7)) == "perturbations.slack=[0, 0.06, 0, 0, 0, 0, 0.06, 0]"
    for case, cables in ((CASE_9, (1, 2)), (CASE_10, (2, 7))):
        by_name = {c.name: c for c in case.cases.configurations}
        assert len(by_name) == len(case.cases.configurations)
        for k, name in enumerate(PLAIN):
            assert slack_change(2 * k, cables) in by_name[name].changes
            assert slack_change(2 * k, cables) in by_name[CORRECTED[k]].changes


def test_thresholds_of_case_10_are_30_newtons_over_what_slack_cables_read():
    readings = load_robot("caroca").slack_readings
    np.testing.assert_array_equal(case_10.THRESHOLDS, readings + case_10.THRESHOLD)


def test_times_of_c3_and_c7():
    pulls = np.full((len(TIME), 8), 100.0)
    pulls[TIME < 1.5, 6] = 10.0
    pulls[TIME >= 2.0, 2] = 5.0
    found = {"time": TIME, "tensions": pulls}
    assert case_10.c7_taut(found) == 1.5
    assert case_10.c3_first(found) == 2.0
    assert case_10.c3_slack(found) == pytest.approx(2.0)
    pulls[:, 2], pulls[:, 6] = 100.0, 0.0
    assert case_10.c7_taut(found) == np.inf
    assert case_10.c3_first(found) == np.inf


def test_the_share_of_a_run_that_is_corrected_counts_until_the_camera_is_there():
    added = np.zeros((len(TIME), 8))
    added[1:3, 4] = -0.01
    path = np.zeros((len(TIME), 3))
    path[:, 0] = np.minimum(TIME, 2.0)
    found = {"tension_corrections": added, "camera_path": path}
    assert case_10.correcting_share(found) == pytest.approx(2.0 / 3.0)
    assert case_10.correcting_share({"camera_path": path}) == 0.0


@pytest.mark.parametrize(
    ("lost", "verdict"),
    [((), "in part"), (("E9",), "confirmed"), (("E9", "E10"), "in part")],
)
def test_which_experiment_fails(lost, verdict):
    """Where none fails, no other fails, at least."""
    runs = made_runs(
        run(name, "target_lost" if name in lost else "timeout", case=CASE_10)
        for name in (*PLAIN, *CORRECTED)
    )
    assert case_10.fails.judge(runs).verdict == verdict


@pytest.mark.parametrize(
    ("px_share", "mm_share", "verdict"),
    [(1.3, 1.0 / 1.3, "confirmed"), (9.0, 10.0, "in part")],  # still better with correction
)
def test_paths_agree_within_a_factor(px_share, mm_share, verdict):
    runs = made_runs(
        run(name, case=CASE_10, image_max_px=px_share * px, camera_max_m=1e-3 * mm_share * mm)
        for name, (px, mm) in case_10.PUBLISHED_PATHS.items()
    )
    assert case_10.paths.judge(runs).verdict == verdict


def test_what_was_chosen_is_shown_beside_what_could_have_been():
    judge = CASE_10.checks[-3]
    rows = [("E7", 0.3), ("E8", 0.1), ("cables_7_plain", 0.2), ("cables_7_corrected", 0.3)]
    runs = made_runs(run(name, case=CASE_10, estimate_max_rad=angle) for name, angle in rows)
    found = judge.judge(runs)
    assert found.verdict == "not testable"
    assert "E8: 0 px" in found.found
    assert "cables_7: 0 px" in found.found
    assert "In 1 of 2 the correction makes" in found.why
