"""The study of broken cables: what it measures, and its words on made-up runs."""

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.break_report import (
    holds_without,
    leaves,
    rest_time,
    speeds,
)
from cdpr_drake.analyses.studies.failure import (
    NONE,
    REDISTRIBUTE,
    STOP,
    STUDY,
    measure,
)
from cdpr_drake.analyses.studies.framework.study import Case
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot
from tests.analyses.studies.made_up_studies import check_statements_tell_apart, check_written

ROBOT = load_robot("acrobot_large")


def test_speeds_and_rest():
    times = np.linspace(0.0, 1.0, 501)
    rows = np.zeros((501, 7))
    rows[:, 0] = 1.0
    moves = times < 0.4
    rows[:, 4] = 0.3 * np.minimum(times, 0.4)
    speed, turning = speeds(rows, times)
    assert speed[10] == pytest.approx(0.3)
    assert np.all(turning == 0.0)
    assert rest_time(times, speed, turning) == pytest.approx(0.4, abs=0.005)
    assert np.sum(moves) == pytest.approx(200, abs=1)


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


def test_a_run():
    row = measure(Case(name="a", keys={"start": 0, "time_s": 0.4, "cable": 5, "reaction": STOP}), 0)
    assert row["speed_m_s"] > 0.01
    assert 0.001 < row["excursion_m"] < 0.5
    assert row["tension_n"] > 5.0
    assert not row["leaves"]


def made_up(case, seed, wrong=False):
    """Redistribution holds, stopping lets it move, nothing lets it fall; with `wrong` contrary."""
    order = ["brake", REDISTRIBUTE, "found", "retreat", "continue", STOP, NONE, "descend"]
    place = order.index(case.keys["reaction"])
    return {
        "outcome": "timeout", "speed_m_s": 0.1, "turn_rad": 0.1, "leaves": wrong,
        "largest_speed_m_s": 0.2 - 0.01 * place if wrong else 0.2 + 0.01 * place,
        "excursion_m": 0.01 * (9.0 - place if wrong else 1.0 + place),
        "impact_m_s": 0.0, "tension_n": 10.0, "slack_s": 0.1, "rest_s": 0.5,
        "holds": case.keys["cable"] % 2 == 0,
    }  # fmt: skip


def test_statements_tell_reactions_apart():
    check_statements_tell_apart(STUDY, made_up)


def test_tables_and_figure(tmp_path):
    check_written(STUDY, made_up, tmp_path)
