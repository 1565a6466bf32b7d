"""One rule for all printed numbers; wrong judgements stay right, see `right_verdicts.yaml`."""

from pathlib import Path

import pytest
import yaml

from cdpr_drake.analyses.reproduction.numbers import judge_number
from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.framework.case_definition import PublishedNumber


def judged(printed, metric="x", values=()):
    number = PublishedNumber(
        group="", configuration="c", label="C", metric=metric, heading="x [mm]", factor=1e3,
        format=".1f", printed=printed,
    )  # fmt: skip
    return judge_number(number, [{metric: value} for value in values])[1]


@pytest.mark.parametrize(
    ("printed", "values", "expected"),
    [
        ("10", (9.0, 12.0, 15.0), "confirmed"),  # in the range
        ("10", (10.5, 10.9, 11.0), "confirmed"),  # within a tenth
        ("10", (11.5, 12.0, 13.0), "in part"),
        ("10", (5.0, 5.1, 5.2), "in part"),
        ("10", (20.5, 21.0, 22.0), "not confirmed"),
        ("about 10", (4.0, 4.5, 4.8), "not confirmed"),
        ("18 or less", (10.0, 12.0, 18.0), "confirmed"),
        ("at most 18", (15.0, 17.0, 19.0), "in part"),
        ("below 2", (1.0, 3.0, 4.0), "not confirmed"),
        ("> 100", (101.0, 120.0, 130.0), "confirmed"),
        ("over 20", (15.0, 21.0, 30.0), "in part"),
        ("a lot", (1.0, 1.0, 1.0), "not judged"),
    ],
)
def test_numbers_and_bounds(printed, values, expected):
    assert judged(printed, values=[value / 1e3 for value in values]) == expected


def test_what_is_not_confirmed_has_a_reason():
    number = PublishedNumber(
        group="", configuration="c", label="C", metric="x", heading="x [mm]", factor=1e3,
        format=".1f", printed="below 2", why="nobody knows",
    )  # fmt: skip
    ours = [{"x": x} for x in (0.001, 0.004, 0.004)]
    why = "our largest over the printed bound 2.00; nobody knows"
    assert judge_number(number, ours)[1:] == ("not confirmed", why)
    assert judge_number(number, 3 * [{"x": 0.001}])[1:] == (
        "confirmed",
        "our largest over the printed bound 0.50",
    )


def test_a_number_that_runs_do_not_have_is_not_testable():
    assert judged("10", values=[0.01, None, 0.01]) == "not testable"


@pytest.mark.parametrize(
    ("printed", "outcomes", "expected"),
    [
        ("converged", 3 * ["converged"], "confirmed"),
        ("converged", 2 * ["converged"] + ["target_lost"], "in part"),
        ("converged", 3 * ["timeout"], "not confirmed"),
        ("converged, 4 s later", 3 * ["converged"], "in part"),
        ("target_lost", 3 * ["target_lost"], "confirmed"),
        ("fails", 2 * ["target_lost"] + ["timeout"], "confirmed"),
        ("fails", 3 * ["converged"], "not confirmed"),
        ("swings about the goal", 3 * ["timeout"], "not judged"),
    ],
)
def test_outcomes(printed, outcomes, expected):
    assert judged(printed, "outcome", outcomes) == expected


RIGHT = yaml.safe_load(Path(__file__).with_name("right_verdicts.yaml").read_text("utf-8"))
NUMBERS = {
    f"{study}/{number.configuration}/{number.metric}": number
    for study in {key.split("/")[0] for key in (*RIGHT["numbers"], *RIGHT["not printed"])}
    for number in STUDIES[study].numbers
}


@pytest.mark.parametrize("key", RIGHT["numbers"])
def test_a_printed_bound_is_judged_as_one_and_a_final_error_at_the_end(key):
    right, number = RIGHT["numbers"][key], NUMBERS[key]
    assert number.printed == right["printed"]
    assert ("_end_" in number.metric) == (right["moment"] == "end")
    printed = float(number.printed.split()[-1])
    half, twice = ([{number.metric: f * printed / number.factor}] for f in (0.45, 2.1))
    bound = not number.printed.startswith("about")
    assert judge_number(number, half)[1] == ("confirmed" if bound else "not confirmed")
    assert judge_number(number, twice)[1] == "not confirmed"


def test_numbers_that_are_not_printed_are_not_judged():
    assert not set(RIGHT["not printed"]) & set(NUMBERS)


def test_all_listed_facts_exist():
    for key in (*RIGHT["statements"], *RIGHT["causes"]):
        study, *name = key.split("/")
        assert key in NUMBERS or name[0] in STUDIES[study].judges, key
