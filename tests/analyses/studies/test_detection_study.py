"""The study of detectors: what it counts, and its words on made-up runs."""

from collections import Counter

import numpy as np

from cdpr_drake.analyses.studies.detection import (
    ALARMS,
    BREAK,
    NOTHING,
    STUDY,
    first_times,
    held_in_a_row,
    limits,
    measure,
    missed_breaks,
    named_for_good,
)
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.study import Case, Form
from tests.analyses.studies.made_up_studies import check_statements_tell_apart, check_written


def test_what_is_above_in_a_row():
    residuals = np.array([[0, 5, 5, 1, 0], [2, 3, 4, 0, 9]], float).T
    assert held_in_a_row(residuals, 1) == 9.0
    assert held_in_a_row(residuals, 2) == 5.0
    assert held_in_a_row(residuals, 3) == 2.0


def test_when_alarms_begin():
    flags = np.array([[0, 0, 1, 1], [0, 0, 0, 0]], float).T
    assert np.array_equal(first_times(flags, np.arange(4.0)), [2.0, np.inf])


def test_the_full_form_has_what_was_asked_for():
    counts = Counter(case.keys["fails"] for case in STUDY.plan(Form()))
    assert counts[NOTHING] == 1000
    assert counts[BREAK] == 96
    assert set(counts) == {NOTHING, *ALARMS}


def test_a_break_is_found_in_a_run():
    row = measure(Case(name="a", keys={"fails": BREAK, "which": 0, "number": 100_000}), 0)
    assert row["told"]
    assert 0.0 < row["delay_s"] < 0.3
    assert row["false"] == 0
    assert row["first"] == BREAK
    assert 0.0 <= row["residual_m"] < limits()[0]
    assert row["named"] == 0
    assert row["carried_n"] > limits()[1]


def test_since_when_a_cable_is_named_for_good():
    times = np.arange(4.0)
    assert named_for_good(np.array([0.0, 1.0, 0.0, 1.0]), times) == 3.0
    assert named_for_good(np.ones(4), times) == 0.0
    assert named_for_good(np.array([1.0, 1.0, 0.0, 0.0]), times) == np.inf


def test_late_and_weak_breaks_are_counted_apart():
    """A late one of a cable that pulls is missed; one of a cable that hardly pulls is not."""
    least = limits()[1]
    rows = [
        {"fails": BREAK, "told": True, "delay_s": delay, "carried_n": pull, "named": named}
        for delay, pull, named in (
            (0.1, 2.0 * least, 0),
            (1.2, 2.0 * least, 1),
            (1.2, 0.5 * least, 0),
        )
    ]
    runs = Runs(
        [Run(f"run {k}", None, {"fails": BREAK}, row, {}) for k, row in enumerate(rows)],
        lambda: {"fails": [BREAK]},
    )
    found = missed_breaks.find(runs)
    assert found.held == [True, False]
    assert "late 2, first another cable 1" in found.found


def made_up(case, seed, wrong=False):
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


def test_statements_tell_detectors_apart():
    check_statements_tell_apart(STUDY, made_up)


def test_tables_and_figure(tmp_path):
    check_written(STUDY, made_up, tmp_path)
