"""Judgements of printed facts that were wrong stay right; see `right_verdicts.yaml`."""

from pathlib import Path

import pytest
import yaml

from cdpr_drake.analyses.reproduction.numbers import judge_number
from cdpr_drake.analyses.studies.catalogue import STUDIES

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
