"""Studies of broken cables and of what detects them: what is measured, and their words."""

from collections import Counter

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.break_report import holds_without, leaves, rest_time, speeds
from cdpr_drake.analyses.studies import detection, failure
from cdpr_drake.analyses.studies.detection import BREAK, NOTHING
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.study import Case, Form
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot
from tests.analyses.studies.made_up_studies import check_told_apart_and_written

ROBOT = load_robot("acrobot_large")


def test_speeds_and_rest():
    times = np.linspace(0.0, 1.0, 501)
    rows = np.zeros((501, 7))
    rows[:, 0], rows[:, 4] = 1.0, 0.3 * np.minimum(times, 0.4)
    speed, turning = speeds(rows, times)
    assert speed[10] == pytest.approx(0.3)
    assert np.all(turning == 0.0)
    assert rest_time(times, speed, turning) == pytest.approx(0.4, abs=0.005)


def test_who_leaves_the_frame():
    home = pose_row(ROBOT.home.transform())
    away = home.copy()
    away[6] = -0.1
    assert np.array_equal(leaves(ROBOT, np.array([home, away])), [False, True])


def test_seven_cables_hold_what_statics_say():
    """At home, by symmetry: those whose loss the others can make up for come in two pairs."""
    row = pose_row(ROBOT.home.transform())
    held = [holds_without(ROBOT, row, cable) for cable in range(8)]
    assert held == [False, False, True, True, True, True, False, False]


def test_a_break_is_measured_and_found_in_a_run():
    keys = {"start": 0, "time_s": 0.4, "cable": 5, "reaction": failure.STOP}
    row = failure.measure(Case(name="a", keys=keys), 0)
    assert row["speed_m_s"] > 0.01
    assert 0.001 < row["excursion_m"] < 0.5
    assert row["tension_n"] > 5.0
    assert not row["leaves"]
    keys = {"fails": BREAK, "which": 0, "number": 100_000}
    row = detection.measure(Case(name="a", keys=keys), 0)
    least_residual, least_pull = detection.limits()[:2]
    assert row["told"]
    assert 0.0 < row["delay_s"] < 0.3
    assert row["false"] == row["named"] == 0
    assert row["first"] == BREAK
    assert 0.0 <= row["residual_m"] < least_residual
    assert row["carried_n"] > least_pull


def test_what_is_above_in_a_row():
    residuals = np.array([[0, 5, 5, 1, 0], [2, 3, 4, 0, 9]], float).T
    assert [detection.held_in_a_row(residuals, n) for n in (1, 2, 3)] == [9.0, 5.0, 2.0]


def test_when_alarms_begin_and_since_when_a_cable_is_named_for_good():
    times = np.arange(4.0)
    flags = np.array([[0, 0, 1, 1], [0, 0, 0, 0]], float).T
    assert np.array_equal(detection.first_times(flags, times), [2.0, np.inf])
    for named, expected in (([0, 1, 0, 1], 3.0), ([1, 1, 1, 1], 0.0), ([1, 1, 0, 0], np.inf)):
        assert detection.named_for_good(np.array(named, float), times) == expected


def test_the_full_form_has_what_was_asked_for():
    counts = Counter(case.keys["fails"] for case in detection.STUDY.plan(Form()))
    assert (counts[NOTHING], counts[BREAK]) == (1000, 96)
    assert set(counts) == {NOTHING, *detection.ALARMS}


def test_late_and_weak_breaks_are_counted_apart():
    """A late one of a cable that pulls is missed; one of a cable that hardly pulls is not."""
    least = detection.limits()[1]
    some = ((0.1, 2.0 * least, 0), (1.2, 2.0 * least, 1), (1.2, 0.5 * least, 0))
    rows = [
        {"fails": BREAK, "told": True, "delay_s": delay, "carried_n": pull, "named": named}
        for delay, pull, named in some
    ]
    runs = [Run(f"run {k}", None, {"fails": BREAK}, row, {}) for k, row in enumerate(rows)]
    found = detection.missed_breaks.find(Runs(runs, lambda: {"fails": [BREAK]}))
    assert found.held == [True, False]
    assert "late 2, first another cable 1" in found.found


def detected(case, seed, wrong=False):
    """Detectors that tell of every failure and of nothing else; with `wrong` contrary."""
    fails = case.keys["fails"] != NOTHING
    return {
        "outcome": "timeout", "time_s": 0.6, "false": int(wrong and not fails),
        "false_kinds": [BREAK] if wrong and not fails else [], "told": fails and not wrong,
        "by_name": fails and not wrong,
        "delay_s": 0.1 if fails and not wrong else None, "first": case.keys["fails"],
        "named": 0, "carried_n": 5.0,
        "residual_m": 0.001, "torque_n_m": 0.001, "lag_m": 1e-4, "tension_n": 1.0,
    }  # fmt: skip


def reacted(case, seed, wrong=False):
    """Redistribution holds, stopping lets it move, nothing lets it fall; with `wrong` contrary."""
    order = ["brake", failure.REDISTRIBUTE, "found", "retreat", "continue", failure.STOP,
             failure.NONE, "descend"]  # fmt: skip
    place = order.index(case.keys["reaction"])
    return {
        "outcome": "timeout", "speed_m_s": 0.1, "turn_rad": 0.1, "leaves": wrong,
        "largest_speed_m_s": 0.2 - 0.01 * place if wrong else 0.2 + 0.01 * place,
        "excursion_m": 0.01 * (9.0 - place if wrong else 1.0 + place),
        "impact_m_s": 0.0, "tension_n": 10.0, "slack_s": 0.1, "rest_s": 0.5,
        "holds": case.keys["cable"] % 2 == 0,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("study", "made_up"), [(detection.STUDY, detected), (failure.STUDY, reacted)]
)
def test_statements_tell_detectors_and_reactions_apart(study, made_up, tmp_path):
    check_told_apart_and_written(study, made_up, tmp_path)
