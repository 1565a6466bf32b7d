"""Studies of broken cables and of what detects them: what is measured."""

from collections import Counter

import numpy as np
import pandas as pd
import pytest

from cdpr_drake.analyses.runs.breaks import (
    STOP,
    holds_without,
    leaves,
    rest_time,
    speeds,
)
from cdpr_drake.analyses.studies.facts import facts_of
from cdpr_drake.analyses.studies.failures import (
    ALARMS,
    BREAK,
    NOTHING,
    STUDIES,
    alarm_cases,
    alarm_row,
    break_row,
    first_times,
    held_in_a_row,
    limits,
    named_for_good,
)
from cdpr_drake.analyses.studies.study import Form
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot

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
    row = break_row(0, 0.4, 5, STOP)
    assert row["speed_m_s"] > 0.01
    assert 0.001 < row["excursion_m"] < 0.5
    assert row["tension_n"] > 5.0
    assert not row["leaves"]
    row = alarm_row(BREAK, 0, 100_000)
    least_residual, least_pull = limits()
    assert row["told"]
    assert row["detectable"]
    assert 0.0 < row["delay_s"] < 0.3
    assert row["false"] == row["named"] == 0
    assert row["first"] == BREAK
    assert 0.0 <= row["residual_m"] < least_residual
    assert row["carried_n"] > least_pull


def test_what_is_above_in_a_row():
    residuals = np.array([[0, 5, 5, 1, 0], [2, 3, 4, 0, 9]], float).T
    assert [held_in_a_row(residuals, n) for n in (1, 2, 3)] == [9.0, 5.0, 2.0]


def test_when_alarms_begin_and_since_when_a_cable_is_named_for_good():
    times = np.arange(4.0)
    flags = np.array([[0, 0, 1, 1], [0, 0, 0, 0]], float).T
    assert np.array_equal(first_times(flags, times), [2.0, np.inf])
    for named, expected in (([0, 1, 0, 1], 3.0), ([1, 1, 1, 1], 0.0), ([1, 1, 0, 0], np.inf)):
        assert named_for_good(np.array(named, float), times) == expected


def test_the_full_form_has_what_was_asked_for():
    counts = Counter(case.keys["fails"] for case in alarm_cases(Form()))
    assert (counts[NOTHING], counts[BREAK]) == (1000, 96)
    assert set(counts) == {NOTHING, *ALARMS}


def test_late_and_weak_breaks_are_told_apart():
    """A late one of a cable that pulls is missed; one of a cable that hardly pulls is not."""
    runs = pd.DataFrame({
        "fails": BREAK, "told": [True, True, True, False], "delay_s": [0.1, 1.2, 1.2, None],
        "detectable": [True, True, False, False],
    })  # fmt: skip
    (fact,) = (one for one in facts_of("detection") if one.name == "missed_breaks")
    verdict = fact.judge(runs, STUDIES["detection"].finds, {}, "")
    assert (verdict["verdict"], verdict["held"], verdict["of"]) == ("in part", 1, 2)
