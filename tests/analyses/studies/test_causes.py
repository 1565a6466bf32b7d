"""What does not hold has a cause: a check of a source names its own before it is run."""

from dataclasses import replace

import pytest

from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.framework.case_definition import Configuration, Plan
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import (
    CHOICE,
    FITTED,
    HARDWARE,
    SOURCE,
    TEST,
    Finding,
    statement,
)
from cdpr_drake.analyses.studies.framework.study import Form

UNNAMED = {
    "tension-methods": {"qp_jumps", "unstable"},
    "worked-examples": {
        "two_programs", "homing_tensions", "border_tensions", "equally_tensed", "two_cables_more",
        "polygon_shrinks", "keeps_limits", "pushes",
    },
    "stability-shapes": {"combinations"},
    "pick-and-place": {"one_camera_fails"},
    "case-9": {"sensor_accuracy"},
}  # fmt: skip
"""Checks of sources that name no cause, by study: where one does not hold, why is not known, or its
finding says so. It may get shorter; a check that is new names a cause."""


@pytest.mark.parametrize("name", STUDIES)
def test_a_check_of_a_source_names_why_it_may_fail(name):
    unnamed = {
        check.name
        for check in getattr(STUDIES[name].run, "checks", ())
        if check.basis in (TEST, FITTED) and not check.cause
    }
    assert unnamed <= UNNAMED.get(name, set())


@pytest.mark.parametrize("name", STUDIES)
def test_printed_numbers_name_why_they_may_differ(name):
    for number in STUDIES[name].numbers:
        assert number.cause in (SOURCE, HARDWARE, CHOICE), number
        assert number.why, number


def judged(held, why=""):
    @statement("It holds.", cause=SOURCE, why="It is not printed.")
    def check(runs):
        return Finding(found="so", held=held, why=why)

    return check.judge(Runs(()))


@pytest.mark.parametrize(
    ("held", "why", "expected"),
    [
        ([False], "", ("source", "It is not printed.")),
        ([False], "It is too far.", ("source", "It is too far.")),
        ([True, False], "", ("source", "It is not printed.")),
        ([True], "", ("", "")),
        ([True], "By a hair.", ("", "By a hair.")),
    ],
)
def test_what_a_check_says_of_a_failure_stands_where_the_finding_says_nothing(held, why, expected):
    found = judged(held, why)
    assert (found.cause, found.why) == expected


def test_an_unknown_cause_is_refused():
    for made in (Configuration, lambda *names, cause: replace(PLAN, cause=cause)):
        with pytest.raises(ValueError, match="cause"):
            made("a", "a", cause="weather")


PLAN = Plan(
    name="made-up",
    title="Made up",
    scenario="acrobot_pbvs",
    configurations=(
        Configuration("a", "a", published={"outcome": "converged"}),
        Configuration("b", "b", published={"outcome": "converged"}, why="Far.", cause=HARDWARE),
    ),
    why="Not printed.",
    cause=SOURCE,
)


def test_a_configuration_s_cause_goes_before_that_of_all():
    told = [(number.why, number.cause) for number in PLAN.published()]
    assert told == [("Not printed.", SOURCE), ("Far.", HARDWARE)]
    assert [(case.why, case.cause) for case in PLAN(Form())] == told
