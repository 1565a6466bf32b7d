"""One rule for all printed numbers."""

from __future__ import annotations

import pytest

from cdpr_drake.analyses.reproduction.numbers import judge_number
from cdpr_drake.analyses.studies.framework.case_definition import PublishedNumber


def judged(printed, metric="x", **ours):
    number = PublishedNumber(
        group="", configuration="c", label="C", metric=metric, heading="x [mm]", factor=1e3,
        format=".1f", printed=printed,
    )  # fmt: skip
    return judge_number(number, {"runs": 3, **ours})[1]


@pytest.mark.parametrize(
    ("printed", "least", "mean", "most", "expected"),
    [
        ("10", 9.0, 12.0, 15.0, "confirmed"),  # in the range
        ("10", 10.5, 10.9, 11.0, "confirmed"),  # within a tenth
        ("10", 11.5, 12.0, 13.0, "in part"),
        ("10", 5.0, 5.1, 5.2, "in part"),
        ("10", 20.5, 21.0, 22.0, "not confirmed"),
        ("about 10", 4.0, 4.5, 4.8, "not confirmed"),
        ("18 or less", 10.0, 12.0, 18.0, "confirmed"),
        ("at most 18", 10.0, 17.0, 19.0, "in part"),
        ("below 2", 1.0, 3.0, 4.0, "not confirmed"),
        ("> 100", 101.0, 120.0, 130.0, "confirmed"),
        ("over 20", 15.0, 21.0, 30.0, "in part"),
        ("a lot", 1.0, 1.0, 1.0, "not judged"),
    ],
)
def test_numbers_and_bounds(printed, least, mean, most, expected):
    ours = {"mean": mean / 1e3, "min": least / 1e3, "max": most / 1e3}
    assert judged(printed, x=ours) == expected


def test_what_is_not_confirmed_has_a_reason():
    number = PublishedNumber(
        group="", configuration="c", label="C", metric="x", heading="x [mm]", factor=1e3,
        format=".1f", printed="below 2", why="nobody knows",
    )  # fmt: skip
    ours = {"runs": 3, "x": {"mean": 0.003, "min": 0.001, "max": 0.004}}
    why = "our largest over the printed bound 2.00; nobody knows"
    assert judge_number(number, ours)[1:] == ("not confirmed", why)
    ours["x"] = {"mean": 0.001, "min": 0.001, "max": 0.001}
    assert judge_number(number, ours)[1:] == (
        "confirmed",
        "our largest over the printed bound 0.50",
    )


def test_a_number_that_runs_do_not_have_is_not_testable():
    assert judged("10", x={"mean": None, "min": None, "max": None}) == "not testable"


@pytest.mark.parametrize(
    ("printed", "outcomes", "expected"),
    [
        ("converged", "3 converged", "confirmed"),
        ("converged", "2 converged, 1 target_lost", "in part"),
        ("converged", "3 timeout", "not confirmed"),
        ("converged, 4 s later", "3 converged", "in part"),
        ("target_lost", "3 target_lost", "confirmed"),
        ("fails", "2 target_lost, 1 timeout", "confirmed"),
        ("fails", "3 converged", "not confirmed"),
        ("swings about the goal", "3 timeout", "not judged"),
    ],
)
def test_outcomes(printed, outcomes, expected):
    assert judged(printed, "outcome", outcomes=outcomes) == expected
