"""Verdicts on the thesis' statements follow the numbers."""

from functools import partial

import pytest

from cdpr_drake.analyses.reporting.statements import CONFIRMED, IN_PART, NOT_CONFIRMED
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Run, Runs
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.tension_methods.statements import CHECKS, GAINS, LP, QP
from cdpr_drake.analyses.studies.tension_methods.study import STUDY

JUDGES = {check.name: check for check in CHECKS}

ROW = {
    "lost": False, "end_time_s": 1.0, "position_error_max_m": 1e-6,
    "position_error_last_tenth_m": 1e-7, "tension_max_n": 5.0, "tension_min_n": 1.0,
    "tension_jump_max_n": 1e-4, "negative_tensions": 0, "failures": 0, "control_steps": 1000,
}  # fmt: skip


def made_up(experiment, method, gain, applied="held", **numbers):
    keys = {
        "experiment": experiment, "robot": "caroca_gazebo", "method": method, "applied": applied,
        "kp_per_s2": gain,
    }  # fmt: skip
    return Run(f"{experiment} {method} {gain} {applied}", None, keys, ROW | numbers)


def verdict(name, runs):
    found = JUDGES[name].judge(Runs(runs))
    assert found.found
    return found.verdict


@pytest.mark.parametrize("name", JUDGES)
def test_nothing_is_said_about_runs_that_were_not_made(name):
    with pytest.raises(MissingRuns):
        JUDGES[name].judge(Runs([], partial(STUDY.planned, Form())))


@pytest.mark.parametrize(("jump", "expected"), [(4.0, CONFIRMED), (1e-4, NOT_CONFIRMED)])
def test_jumps_of_the_linear_program(jump, expected):
    runs = [
        made_up("thesis", LP, gain, tension_jump_max_n=4.0 if gain > 100.0 else jump)
        for gain in GAINS
    ]
    assert verdict("lp_jumps", runs) == expected


@pytest.mark.parametrize(
    ("jump", "expected"), [(4.0, CONFIRMED), (0.1, IN_PART), (None, NOT_CONFIRMED)]
)
def test_jumps_of_the_quadratic_program(jump, expected):
    most = 4.0 if jump else 0.0
    runs = [
        made_up("thesis", QP, gain, tension_jump_max_n=most if gain > 100.0 else jump or 0.0)
        for gain in (*GAINS, 1500.0)
    ]
    assert verdict("qp_jumps", runs) == expected


@pytest.mark.parametrize(
    ("thesis", "step", "expected"),
    [
        ((1.7, 4.1, 3.6), (2.0, 2.0, 2.0), CONFIRMED),
        ((1.01, 1.01, 1.01), (2.0, 2.0, 2.0), IN_PART),  # below, but by too little
        ((1.7, 4.1, 3.6), (0.5, 0.5, 0.5), IN_PART),
        ((0.1, 0.1, 0.1), (0.5, 0.5, 0.5), NOT_CONFIRMED),
    ],
)
def test_quadratic_against_linear_program(thesis, step, expected):
    """The linear program's largest tensions as multiples of the quadratic program's."""
    runs = [
        made_up(name, method, gain, tension_max_n=tension)
        for name, factors in (("thesis", thesis), ("step", step))
        for gain, factor in zip(GAINS, factors, strict=True)
        for method, tension in ((QP, 1.0), (LP, factor))
    ]
    assert verdict("qp_needs_less", runs) == expected


@pytest.mark.parametrize(
    ("still", "step", "expected"),
    [
        ((1.0, 1.9, 3.5), 2.0, CONFIRMED),
        ((1.0, 1.06, 1.12), 2.0, IN_PART),
        ((1.0, 1.06, 1.12), 1.0, NOT_CONFIRMED),
    ],
)
def test_tensions_grow_with_the_gain(still, step, expected):
    runs = [
        made_up(name, QP, gain, tension_max_n=tension)
        for name, tensions in (("thesis", still), ("step", (1.0, 1.0, step)))
        for gain, tension in zip(GAINS, tensions, strict=True)
    ]
    assert verdict("tension_grows", runs) == expected


@pytest.mark.parametrize(
    ("errors", "falls", "no_better"),
    [
        ((3e-6, 2e-6, 1e-6, 0.99e-6), CONFIRMED, CONFIRMED),
        ((3e-6, 2.97e-6, 2.94e-6, 2.9e-6), NOT_CONFIRMED, CONFIRMED),
        ((3e-6, 1e-6, 2e-6, 1.1e-6), NOT_CONFIRMED, IN_PART),
        ((3e-6, 4e-6, 5e-6, 1e-6), NOT_CONFIRMED, NOT_CONFIRMED),
    ],
)
def test_errors_against_the_gain(errors, falls, no_better):
    runs = [
        made_up("thesis", method, gain, position_error_max_m=error)
        for method in (LP, QP)
        for gain, error in zip((*GAINS, 1500.0), errors, strict=True)
    ]
    assert verdict("error_falls", runs) == falls
    assert verdict("no_better", runs) == no_better


def test_errors_of_one_program_do_not_stand_for_both():
    runs = [
        made_up("thesis", method, gain, position_error_max_m=error)
        for method, errors in ((LP, (1e-6, 1e-6, 1e-6)), (QP, (3e-6, 2e-6, 1e-6)))
        for gain, error in zip(GAINS, errors, strict=True)
    ]
    assert verdict("error_falls", runs) == NOT_CONFIRMED


@pytest.mark.parametrize(
    ("inside", "printed", "expected"),
    [(-1.0, -1.0, CONFIRMED), (0.5, -1.0, IN_PART), (-1.0, 0.5, NOT_CONFIRMED)],
)
def test_negative_tensions_of_the_pseudo_inverse(inside, printed, expected):
    runs = [
        made_up(name, "pseudo_inverse", 100.0, "pushed", tension_min_n=least)
        for name, least in (("thesis", inside), ("printed", printed))
    ]
    assert verdict("pseudo_inverse_negative", runs) == expected


@pytest.mark.parametrize(
    ("first", "last", "expected"),
    [(117.0, 117.0, CONFIRMED), (11.7, 11.7, IN_PART), (11.7, 117.0, NOT_CONFIRMED)],
)
def test_the_pseudo_inverse_needs_the_same_at_all_gains(first, last, expected):
    runs = [
        made_up("printed", "pseudo_inverse", gain, "pushed", tension_max_n=tension)
        for gain, tension in zip(GAINS, (first, first, last), strict=True)
    ]
    assert verdict("pseudo_inverse_117", runs) == expected


@pytest.mark.parametrize(
    ("largest", "smallest", "expected"),
    [
        ((267.0, 385.0, 517.0), -1.0, CONFIRMED),
        ((267.0, 267.0, 267.0), -1.0, IN_PART),
        ((267.0, 385.0, 517.0), 1.0, NOT_CONFIRMED),
    ],
)
def test_the_closed_form_is_negative_and_grows(largest, smallest, expected):
    """Each verdict can be reached: once the first of them could not."""
    runs = [
        made_up(
            "thesis", "closed_form", gain, "pushed", tension_max_n=tension, tension_min_n=smallest
        )
        for gain, tension in zip(GAINS, largest, strict=True)
    ]
    assert verdict("closed_form_negative", runs) == expected


@pytest.mark.parametrize(("error", "expected"), [(1e-3, CONFIRMED), (1e-7, NOT_CONFIRMED)])
def test_a_steady_error_of_the_closed_form_would_be_seen(error, expected):
    runs = [
        made_up("thesis", "closed_form", 100.0, applied, position_error_last_tenth_m=error)
        for applied in ("pushed", "cut")
    ]
    assert verdict("closed_form_steady", runs) == expected


@pytest.mark.parametrize(
    ("error", "failures", "expected"),
    [(1e-3, 0, CONFIRMED), (1e-9, 0, NOT_CONFIRMED), (1e-9, 5, IN_PART)],
)
def test_instability_at_high_gains_can_be_confirmed(error, failures, expected):
    rows = [
        made_up("thesis", QP, 100.0),
        made_up("thesis", LP, 1200.0, position_error_max_m=error),
        made_up("thesis", QP, 1500.0, position_error_max_m=error),
        made_up("far_step", QP, 1200.0),
    ]
    rows += [made_up("slow", QP, gain, failures=failures) for gain in (*GAINS, 1500.0)]
    assert verdict("unstable", rows) == expected
