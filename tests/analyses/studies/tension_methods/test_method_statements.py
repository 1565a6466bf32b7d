"""Verdicts on the thesis' statements follow the numbers, and each of them can be reached."""

from functools import partial

import matplotlib.pyplot as plt
import pytest
from cdpr_drake.analyses.studies.tension_methods.gain_figures import LARGEST
from cdpr_drake.analyses.studies.tension_methods.start_figures import (
    one_step_figure,
    start_figure,
    start_tables,
)
from cdpr_drake.analyses.studies.tension_methods.start_statements import FACTOR, START_CHECKS
from cdpr_drake.analyses.studies.tension_methods.statements import CHECKS, GAINS, LP, QP
from cdpr_drake.analyses.studies.tension_methods.study import STUDY

from cdpr_drake.analyses.reporting.statements import CONFIRMED, IN_PART, NOT_CONFIRMED
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Run, Runs
from cdpr_drake.analyses.studies.framework.statement import FITTED, MET_FITTED
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.tension_methods import start_experiments as starts

JUDGES = {check.name: check for check in CHECKS}

ROW = {
    "lost": False, "end_time_s": 1.0, "position_error_max_m": 1e-6,
    "position_error_last_tenth_m": 1e-7, "tension_max_n": 5.0, "tension_min_n": 1.0,
    "tension_jump_max_n": 1e-4, "negative_tensions": 0, "failures": 0, "control_steps": 1000,
}  # fmt: skip

JUMP, MOST, LEAST = "tension_jump_max_n", "tension_max_n", "tension_min_n"
ERROR, LATE = "position_error_max_m", "position_error_last_tenth_m"


def run(experiment, method, gain=100.0, applied="held", **numbers):
    keys = {
        "experiment": experiment, "robot": "caroca_gazebo", "method": method, "applied": applied,
        "kp_per_s2": gain,
    }  # fmt: skip
    return Run(f"{experiment} {method} {gain} {applied}", None, keys, ROW | numbers)


def series(experiment, method, column, values, applied="held", **more):
    """A run for each gain, the highest of which the thesis found unstable."""
    gains = (*GAINS, 1500.0)[: len(values)]
    return [
        run(experiment, method, gain, applied, **{column: value}, **more)
        for gain, value in zip(gains, values, strict=True)
    ]


def both(values):
    return [one for method in (LP, QP) for one in series("thesis", method, ERROR, values)]


def against(thesis, step):
    """The linear program's largest tensions as multiples of the quadratic program's."""
    pairs = (("thesis", thesis), ("step", step))
    return [
        one
        for name, factors in pairs
        for one in (*series(name, QP, MOST, [1.0] * 3), *series(name, LP, MOST, factors))
    ]


def growing(still, step):
    return series("thesis", QP, MOST, still) + series("step", QP, MOST, (1.0, 1.0, step))


def pushed(inside, printed):
    pairs = (("thesis", inside), ("printed", printed))
    return [run(name, "pseudo_inverse", applied="pushed", **{LEAST: n}) for name, n in pairs]


def same_at_all(*values):
    return series("printed", "pseudo_inverse", MOST, values, "pushed")


def closed_form(largest, smallest):
    return series("thesis", "closed_form", MOST, largest, "pushed", **{LEAST: smallest})


def steady(error):
    ways = ("pushed", "cut")
    return [run("thesis", "closed_form", applied=one, **{LATE: error}) for one in ways]


def at_high_gains(error, failures):
    far = {ERROR: error}
    return [
        run("thesis", QP), run("thesis", LP, 1200.0, **far), run("thesis", QP, 1500.0, **far),
        run("far_step", QP, 1200.0), *series("slow", QP, "failures", [failures] * 4),
    ]  # fmt: skip


@pytest.mark.parametrize("name", JUDGES)
def test_nothing_is_said_about_runs_that_were_not_made(name):
    with pytest.raises(MissingRuns):
        JUDGES[name].judge(Runs([], partial(STUDY.planned, Form())))


@pytest.mark.parametrize(
    ("name", "runs", "expected"),
    [
        ("lp_jumps", series("thesis", LP, JUMP, (4.0, 4.0, 4.0)), CONFIRMED),
        ("lp_jumps", series("thesis", LP, JUMP, (1e-4, 4.0, 4.0)), NOT_CONFIRMED),
        ("qp_jumps", series("thesis", QP, JUMP, (4.0, 4.0, 4.0, 4.0)), CONFIRMED),
        ("qp_jumps", series("thesis", QP, JUMP, (0.1, 4.0, 4.0, 4.0)), IN_PART),
        ("qp_jumps", series("thesis", QP, JUMP, (0.0, 0.0, 0.0, 0.0)), NOT_CONFIRMED),
        ("qp_needs_less", against((1.7, 4.1, 3.6), (2.0, 2.0, 2.0)), CONFIRMED),
        # Below, but by too little.
        ("qp_needs_less", against((1.01, 1.01, 1.01), (2.0, 2.0, 2.0)), IN_PART),
        ("qp_needs_less", against((1.7, 4.1, 3.6), (0.5, 0.5, 0.5)), IN_PART),
        ("qp_needs_less", against((0.1, 0.1, 0.1), (0.5, 0.5, 0.5)), NOT_CONFIRMED),
        ("tension_grows", growing((1.0, 1.9, 3.5), 2.0), CONFIRMED),
        ("tension_grows", growing((1.0, 1.06, 1.12), 2.0), IN_PART),
        ("tension_grows", growing((1.0, 1.06, 1.12), 1.0), NOT_CONFIRMED),
        ("error_falls", both((3e-6, 2e-6, 1e-6, 0.99e-6)), CONFIRMED),
        ("error_falls", both((3e-6, 2.97e-6, 2.94e-6, 2.9e-6)), NOT_CONFIRMED),
        ("error_falls", both((3e-6, 1e-6, 2e-6, 1.1e-6)), NOT_CONFIRMED),
        ("error_falls", both((3e-6, 4e-6, 5e-6, 1e-6)), NOT_CONFIRMED),
        # Errors of one program do not stand for both.
        ("error_falls", series("thesis", LP, ERROR, (1e-6, 1e-6, 1e-6))
         + series("thesis", QP, ERROR, (3e-6, 2e-6, 1e-6)), NOT_CONFIRMED),
        ("no_better", both((3e-6, 2e-6, 1e-6, 0.99e-6)), CONFIRMED),
        ("no_better", both((3e-6, 2.97e-6, 2.94e-6, 2.9e-6)), CONFIRMED),
        ("no_better", both((3e-6, 1e-6, 2e-6, 1.1e-6)), IN_PART),
        ("no_better", both((3e-6, 4e-6, 5e-6, 1e-6)), NOT_CONFIRMED),
        ("pseudo_inverse_negative", pushed(-1.0, -1.0), CONFIRMED),
        ("pseudo_inverse_negative", pushed(0.5, -1.0), IN_PART),
        ("pseudo_inverse_negative", pushed(-1.0, 0.5), NOT_CONFIRMED),
        ("pseudo_inverse_117", same_at_all(117.0, 117.0, 117.0), CONFIRMED),
        ("pseudo_inverse_117", same_at_all(11.7, 11.7, 11.7), IN_PART),
        ("pseudo_inverse_117", same_at_all(11.7, 11.7, 117.0), NOT_CONFIRMED),
        # The first of them once could not be reached.
        ("closed_form_negative", closed_form((267.0, 385.0, 517.0), -1.0), CONFIRMED),
        ("closed_form_negative", closed_form((267.0, 267.0, 267.0), -1.0), IN_PART),
        ("closed_form_negative", closed_form((267.0, 385.0, 517.0), 1.0), NOT_CONFIRMED),
        ("closed_form_steady", steady(1e-3), CONFIRMED),
        ("closed_form_steady", steady(1e-7), NOT_CONFIRMED),
        ("unstable", at_high_gains(1e-3, 0), CONFIRMED),
        ("unstable", at_high_gains(1e-9, 0), NOT_CONFIRMED),
        ("unstable", at_high_gains(1e-9, 5), IN_PART),
    ],
)  # fmt: skip
def test_verdicts_follow_the_numbers(name, runs, expected):
    found = JUDGES[name].judge(Runs(runs))
    assert found.found
    assert found.verdict == expected


STARTS = {check.name: check for check in START_CHECKS}

START_ROW = {
    "lost": False, "end_time_s": 1.0, "tension_min_n": 1.0, "tension_first_max_n": 5.0,
    "tension_last_max_n": 5.0, "turn_max_rad": 0.1, "position_error_last_tenth_m": 1e-3,
    "failures": 0, "control_steps": 100,
}  # fmt: skip


def started(factor):
    """All planned runs beside their path, with so many times the printed tensions."""
    rows = []
    for spec in starts.start_trials(quick=False):
        size = factor(spec) * starts.PRINTED[spec.method][starts.GAINS.index(spec.gain)]
        row = START_ROW | {"tension_max_n": size, "start_error_m": spec.start_error()}
        rows.append(Run(spec.name(), None, spec.keys(), row))
    return Runs(rows)


def verdict(name, factor):
    return STARTS[name].judge(started(factor)).verdict


@pytest.mark.parametrize("name", [name for name in STARTS if name.startswith("largest")])
def test_sizes_are_judged_by_a_factor(name):
    good = MET_FITTED if STARTS[name].basis == FITTED else CONFIRMED
    for factor in (1.0, 0.99 * FACTOR, 1.01 / FACTOR):
        assert verdict(name, lambda spec, factor=factor: factor) == good, factor
    for factor in (1.01 * FACTOR, 0.99 / FACTOR, 0.1):
        assert verdict(name, lambda spec, factor=factor: factor) == NOT_CONFIRMED, factor
    assert verdict(name, lambda spec: 1.0 if spec.gain == 800.0 else 9.0) == IN_PART


@pytest.mark.parametrize(
    ("name", "is_good", "first", "last"),
    [
        ("largest_by_start_error",
         lambda spec: (spec.start, spec.rate, spec.balance) == ("0.4 m", 100.0, "force"),
         "0.4 m, 100 Hz, force", ": 0, 0, 0, 0, 0, 0, 0, 12, 0, 0, 0, 0, 0, 0, 0, 0"),
        ("largest_one_step_best",
         lambda spec: (spec.start, spec.between) == ("path", "nothing"),
         "start: path, between: nothing", ": 0, 0, 0, 12"),
    ],
)  # fmt: skip
def test_the_best_start_is_found_and_told(name, is_good, first, last):
    found = STARTS[name].judge(started(lambda spec: 1.0 if is_good(spec) else 9.0))
    assert found.verdict == MET_FITTED
    assert found.found.startswith(first)
    assert found.found.endswith(last)


@pytest.mark.parametrize(
    ("sizes", "expected"),
    [
        ((1.0, 1.0, 1.0), CONFIRMED),
        ((3.0, 3.0, 3.0), IN_PART),
        ((1.0, 1.0, 1.2), IN_PART),
        ((1.0, 1.0, 3.0), NOT_CONFIRMED),
    ],
)
def test_117_at_all_gains(sizes, expected):
    assert verdict("one_step_117", lambda spec: sizes[starts.GAINS.index(spec.gain)]) == expected


def test_one_fact_is_counted_once():
    same = {check.name: check.same_as for check in START_CHECKS}
    assert same.pop("largest_at_launch") == ""
    assert all(same.values())


def test_printed_values_are_those_of_the_other_figures():
    for method, values in starts.PRINTED.items():
        assert LARGEST[method][: len(starts.GAINS)] == values


def test_tables_and_figures_of_starts():
    runs = started(lambda spec: 1.0)
    assert [table.row_count for table in start_tables(runs)] == [80, 16]
    for figure in (start_figure(runs), one_step_figure(runs)):
        assert len(figure.axes) in (4, 16)
        plt.close(figure)
