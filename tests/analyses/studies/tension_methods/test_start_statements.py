"""Verdicts on largest tensions follow the sizes, and each can be reached."""

import matplotlib.pyplot as plt
import pytest

from cdpr_drake.analyses.reporting.statements import CONFIRMED, IN_PART, NOT_CONFIRMED
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.statement import FITTED, MET_FITTED
from cdpr_drake.analyses.studies.tension_methods.gain_figures import LARGEST
from cdpr_drake.analyses.studies.tension_methods.start_experiments import (
    GAINS,
    PRINTED,
    start_trials,
)
from cdpr_drake.analyses.studies.tension_methods.start_figures import (
    one_step_figure,
    start_figure,
    start_tables,
)
from cdpr_drake.analyses.studies.tension_methods.start_statements import FACTOR, START_CHECKS

JUDGES = {check.name: check for check in START_CHECKS}

ROW = {
    "lost": False, "end_time_s": 1.0, "tension_min_n": 1.0, "tension_first_max_n": 5.0,
    "tension_last_max_n": 5.0, "turn_max_rad": 0.1, "position_error_last_tenth_m": 1e-3,
    "failures": 0, "control_steps": 100,
}  # fmt: skip


def made_up(factor):
    """All planned runs, with so many times the printed tensions: a number, or what gives it."""
    rows = []
    for spec in start_trials(quick=False):
        share = factor(spec) if callable(factor) else factor
        size = share * PRINTED[spec.method][GAINS.index(spec.gain)]
        row = ROW | {"tension_max_n": size, "start_error_m": spec.start_error()}
        rows.append(Run(spec.name(), None, spec.keys(), row))
    return Runs(rows)


def verdict(name, factor):
    return JUDGES[name].judge(made_up(factor)).verdict


SIZES = [name for name in JUDGES if name.startswith("largest")]


@pytest.mark.parametrize("name", SIZES)
def test_sizes_are_judged_by_a_factor(name):
    good = MET_FITTED if JUDGES[name].basis == FITTED else CONFIRMED
    for factor in (1.0, 0.99 * FACTOR, 1.01 / FACTOR):
        assert verdict(name, factor) == good
    for factor in (1.01 * FACTOR, 0.99 / FACTOR, 0.1):
        assert verdict(name, factor) == NOT_CONFIRMED
    assert verdict(name, lambda spec: 1.0 if spec.gain == 800.0 else 9.0) == IN_PART


def test_the_best_start_error_is_found_and_told():
    def factor(spec):
        chosen = spec.start == "0.4 m" and spec.rate == 100.0 and spec.balance == "force"
        return 1.0 if chosen else 9.0

    found = JUDGES["largest_by_start_error"].judge(made_up(factor))
    assert found.verdict == MET_FITTED
    assert found.found.startswith("0.4 m, 100 Hz, force")
    assert found.found.endswith(": 0, 0, 0, 0, 0, 0, 0, 12, 0, 0, 0, 0, 0, 0, 0, 0")


def test_the_best_of_forces_that_act_a_tenth_of_the_time_is_found_and_told():
    found = JUDGES["largest_one_step_best"].judge(
        made_up(lambda spec: 1.0 if (spec.start, spec.between) == ("path", "nothing") else 9.0)
    )
    assert found.verdict == MET_FITTED
    assert found.found.startswith("start: path, between: nothing")
    assert found.found.endswith(": 0, 0, 0, 12")


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
    assert verdict("one_step_117", lambda spec: sizes[GAINS.index(spec.gain)]) == expected


def test_one_fact_is_counted_once():
    same = {check.name: check.same_as for check in START_CHECKS}
    assert same.pop("largest_at_launch") == ""
    assert all(same.values())


def test_printed_values_are_those_of_the_other_figures():
    for method, values in PRINTED.items():
        assert LARGEST[method][: len(GAINS)] == values


def test_tables_and_figures():
    runs = made_up(1.0)
    assert [table.row_count for table in start_tables(runs)] == [80, 16]
    for figure in (start_figure(runs), one_step_figure(runs)):
        assert len(figure.axes) in (4, 16)
        plt.close(figure)
