"""Facts: each comparison, what cannot be written, and the verdict that follows."""

import numpy as np
import pandas as pd
import pytest
from pydantic import ValidationError

from cdpr_drake.analyses.studies.facts import (
    Entry,
    Fact,
    MissingRuns,
    Part,
    check_facts,
    facts_of,
    scorecard,
    source_of,
    sources,
)
from cdpr_drake.analyses.studies.study import STUDIES, study_named

ROWS = pd.DataFrame({
    "robot": ["a", "a", "b", "b", "c", "c"],
    "seed": [0, 1] * 3,
    "error_m": [0.01, 0.03, 0.04, 0.04, 0.08, 0.08],
    "other_m": [0.01, 0.01, 0.02, 0.02, 0.02, 0.02],
    "angle_rad": np.radians([1.0, 3.0, 5.0, 5.0, 9.0, 9.0]),
    "outcome": ["converged", "converged", "converged", "lost", "lost", "lost"],
    "polygon.inside": [True, False, True, True, False, False],
})  # fmt: skip

BY = {"robot": ["a", "b", "c"]}

HOLDS = {
    "about, factor": ({"of": "error_m", "where": {"robot": "a"}, "about": 10, "factor": 2}, [1]),
    "about, share": ({"of": "error_m", "where": {"robot": "a"}, "about": 21, "share": 0.1}, [1]),
    "about, tolerance": ({"of": "error_m", "by": BY, "about": [20, 40, 90], "tolerance": 5},
                         [1, 1, 0]),
    "at most": ({"of": "error_m", "by": BY, "at_most": 40}, [1, 1, 0]),
    "below": ({"of": "error_m", "by": BY, "below": 40}, [1, 0, 0]),
    "at least": ({"of": "error_m", "by": BY, "at_least": 40}, [0, 1, 1]),
    "above": ({"of": "error_m", "by": BY, "above": 40}, [0, 0, 1]),
    "largest of a group": ({"of": "error_m", "where": {"robot": "a"}, "over": "max",
                            "at_most": 29}, [0]),
    "all rows": ({"of": "error_m", "over": "each", "at_most": 40, "take": "all"}, [0]),
    "most rows": ({"of": "error_m", "over": "each", "at_most": 40, "take": "most"}, [1]),
    "any row": ({"of": "error_m", "over": "each", "above": 79, "take": "any"}, [1]),
    "than": ({"of": "error_m", "by": BY, "at_least": "than", "than": {"of": "other_m"},
              "times": 2.0}, [1, 1, 1]),
    "than, plus": ({"of": "error_m", "where": {"robot": "a"}, "below": "than",
                    "than": {"where": {"robot": "b"}}, "plus": -21}, [0]),
    "per": ({"of": "error_m", "by": BY, "per": {"of": "other_m"}, "about": 2, "factor": 1.1},
            [1, 1, 0]),
    "minus": ({"of": "error_m", "by": BY, "minus": {"of": "other_m"}, "about": 20,
               "tolerance": 11}, [1, 1, 0]),
    "paired": ({"of": "error_m", "where": {"robot": "b"}, "paired": ["seed"], "above": "than",
                "than": {"where": {"robot": "a"}}, "plus": 10.5}, [1, 0]),
    "is": ({"of": "outcome", "by": BY, "is": "converged"}, [1, 0, 0]),
    "is, in a table": ({"of": "polygon.inside", "by": BY, "is": True}, [0, 1, 0]),
    "rising": ({"of": "error_m", "by": BY, "rising": 1.9}, [1, 1]),
    "rising, not enough": ({"of": "error_m", "by": BY, "rising": [2.1, 1.0]}, [0, 1]),
    "falling": ({"of": "error_m", "by": {"robot": ["c", "b", "a"]}, "falling": 1}, [1, 1]),
    "equal does not rise": ({"of": "other_m", "by": BY, "rising": 1}, [1, 0]),
    "not strict": ({"of": "other_m", "by": BY, "rising": 1, "strict": False}, [1, 1]),
    "same": ({"of": "other_m", "by": {"robot": ["b", "c"]}, "same": 1}, [1]),
    "same, share": ({"of": "error_m", "by": {"robot": ["b", "c"]}, "same": 1, "share": 0.4}, [0]),
    "largest": ({"of": "error_m", "by": BY, "largest": "c"}, [1]),
    "smallest": ({"of": "error_m", "by": BY, "smallest": "b"}, [0]),
    "holds": ({"holds": "error_m > other_m"}, [0, 1, 1, 1, 1, 1]),
    "expression": ({"of": "error_m - other_m", "where": {"robot": "b"}, "about": 20,
                    "tolerance": 0.1}, [1]),
    "rows": ({"of": "error_m", "rows": "seed == 1", "by": BY, "about": [30, 40, 80],
              "tolerance": 0.1}, [1, 1, 1]),
    "no such row": ({"of": "error_m", "rows": "seed == 9", "below": 100}, [0]),
    "angle": ({"of": "angle_rad", "where": {"robot": "a"}, "unit": "deg", "about": 2,
               "tolerance": 0.1}, [1]),
    "several columns": ({"of": ["error_m", "other_m"], "where": {"robot": "a"}, "over": "max",
                         "about": 30, "tolerance": 0.1}, [1]),
    "drop": ({"of": "error_m", "where": {"robot": "a"}, "over": "drop", "about": -20,
              "tolerance": 0.1}, [1]),
    "across": ({"of": "error_m", "by": BY, "across": "max", "about": 80, "tolerance": 0.1}, [1]),
}  # fmt: skip


def part(words):
    return Part(**{"unit": "mm", **words})


@pytest.mark.parametrize(("words", "held"), HOLDS.values(), ids=HOLDS)
def test_a_comparison_says_which_numbers_hold(words, held):
    found, words = part(words).judge(ROWS)
    assert found == [bool(one) for one in held]
    assert words


def test_words_have_the_numbers_and_the_unit_of_the_print():
    one = part({"of": "error_m", "by": BY, "at_most": 40})
    assert one.judge(ROWS)[1] == "a 20, b 40, c 80 mm"
    assert one.print_words() == "at most 40 mm"
    assert Part(of="tension_n.C1", below=3).print_words() == "below 3 N"
    near = part({"of": "angle_rad", "unit": "deg", "about": 5, "share": 0.2})
    assert near.print_words() == "about 5 deg (within 20 %)"


MISSING = {
    "value": {"of": "error_m", "where": {"robot": "d"}, "below": 1},
    "value of by": {"of": "error_m", "by": {"robot": ["a", "d"]}, "below": 1},
    "column": {"of": "no_such_m", "below": 1},
    "key": {"of": "error_m", "where": {"camera": "x"}, "below": 1},
}


@pytest.mark.parametrize("words", MISSING.values(), ids=MISSING)
def test_rows_that_lack_are_no_comparison(words):
    with pytest.raises(MissingRuns):
        part(words).judge(ROWS)


SIZE = {"of": "error_m", "where": {"robot": "a"}, "unit": "mm", "about": 20, "share": 0.1}
FACT = {
    "name": "size", "study": "x", "says": "The error is 20 mm.", "basis": "independent",
    "parts": [SIZE],
}  # fmt: skip

REFUSED = {
    "a bare number": ({"parts": [{"of": "error_m"}]}, "found no comparison"),
    "two comparisons": ({"parts": [{**SIZE, "below": 3}]}, "found about, below"),
    "a size without nearness": ({"parts": [{"of": "error_m", "about": 3}]}, "with factor, share"),
    "a bound as a size": ({"says": "It is at most 20 mm."}, "prints a bound; found about"),
    "a bound below": ({"says": "It does not surpass 20 mm."}, "accepted: at_most or below"),
    "a bound above": ({"says": "It is more than 20 mm."}, "accepted: at_least or above"),
    "no more than": ({"says": "No cable needs more than 20 N."}, "accepted: at_most or below"),
    "an unknown unit": ({"parts": [{**SIZE, "unit": "mN"}]}, "unit: found mN; accepted: mm"),
    "no basis": ({"basis": None}, "basis"),
    "fitted without reason": ({"basis": "fitted"}, "basis fitted; accepted with its reason"),
    "a cause without reason": ({"cause": {"source": "?"}}, "cause; accepted with its reason"),
    "an unknown cause": ({"cause": {"weather": "it was so warm"}}, "weather"),
    "neither parts nor find": ({"parts": []}, "accepted: parts, or find"),
    "both": ({"find": "best"}, "accepted: parts, or find"),
    "a misspelt key": ({"partz": []}, "partz"),
    "than of nothing": ({"parts": [{"of": "error_m", "below": "than"}]}, "than: accepted with"),
}


@pytest.mark.parametrize(("change", "words"), REFUSED.values(), ids=REFUSED)
def test_what_misjudged_facts_once_cannot_be_written(change, words):
    with pytest.raises(ValidationError, match=words):
        Fact(**{**FACT, **change})


def test_equal_parts_or_names_in_two_facts_are_refused():
    first = Fact(**FACT)
    with pytest.raises(ValueError, match="x/again: the same as x/size"):
        check_facts([first, Fact(**{**FACT, "name": "again"})])
    other = {**FACT, "parts": [{**SIZE, "about": 30}]}
    with pytest.raises(ValueError, match="x/size: the same as x/size"):
        check_facts([first, Fact(**other)])


def judged(rows=ROWS, finds=None, moments=None, unjudged="", **change):
    return Fact(**{**FACT, **change}).judge(rows, finds or {}, moments or {}, unjudged)


GOOD, BAD = SIZE, {**SIZE, "about": 99}
REASON = {"reason": "chosen with it in sight"}
CAUSE = {"source": "a gain is not printed"}

VERDICTS = {
    "all hold": ({}, "confirmed"),
    "ours": ({"basis": "ours"}, "confirmed"),
    "fitted": ({"basis": "fitted", **REASON}, "met (fitted)"),
    "by construction": ({"basis": "by construction", **REASON}, "met (by construction)"),
    "some hold": ({"parts": [GOOD, BAD]}, "in part"),
    "half is not most": ({"parts": [GOOD, BAD], "in_part": "most"}, "not confirmed"),
    "none holds": ({"parts": [BAD]}, "not confirmed"),
    "in part by a weaker comparison": ({"parts": [BAD], "in_part": [GOOD]}, "in part"),
    "rows lack": ({"parts": [{**GOOD, "where": {"robot": "z"}}]}, "not judged"),
    "judging fails": ({"parts": [{**GOOD, "of": "outcome"}]}, "not judged"),
}


@pytest.mark.parametrize(("change", "verdict"), VERDICTS.values(), ids=VERDICTS)
def test_a_verdict_follows_from_the_parts(change, verdict):
    found = judged(**{"cause": CAUSE, **change})
    assert found["verdict"] == verdict
    failed = verdict in ("in part", "not confirmed")
    assert found["cause"] == ("source: a gain is not printed" if failed else "")


def test_a_cause_is_told_or_said_to_be_unknown():
    assert judged(parts=[BAD])["cause"] == "not known"


def test_without_rows_nothing_is_judged():
    found = judged(rows=None, unjudged="interrupted")
    assert (found["verdict"], found["found"], found["of"]) == ("interrupted", "", 0)


def test_a_function_judges_what_is_no_comparison():
    finds = {"best": lambda rows: ([True, rows["seed"].max() == 5], "a is best")}
    found = judged(parts=[], find="best", finds=finds)
    assert (found["verdict"], found["held"], found["of"]) == ("in part", 1, 2)
    assert found["found"] == "a is best"
    found = judged(parts=[], find="best", finds={"best": lambda rows: ([], "no run is slack")})
    assert (found["verdict"], found["found"]) == ("not judged", "no run is slack")


def test_a_number_of_a_curve_says_which_it_is():
    moments = {"error_m": "largest"}
    assert judged(moments=moments, parts=[{**SIZE, "moment": "largest"}])["verdict"] == "confirmed"
    with pytest.raises(ValueError, match="is the largest value of a run, the print's is the end"):
        judged(moments=moments, parts=[{**SIZE, "moment": "end"}])
    with pytest.raises(ValueError, match="is the largest value of a run, the print's is the only"):
        judged(moments=moments)


def test_ours_count_apart():
    found = [judged(), judged(parts=[BAD]), judged(basis="ours")]
    assert scorecard(found) == {
        "verdicts": {"confirmed": 1, "not confirmed": 1}, "ours": {"confirmed": 1}
    }  # fmt: skip


def test_entries_are_printed_in_their_section():
    source = source_of({"title": "A thesis", "sections": {
        "3.4: Control": [FACT, {"says": "A map", "missing": "its data", "at": ["figure 1"]}],
    }})  # fmt: skip
    fact, entry = source.sections["3.4: Control"]
    assert isinstance(fact, Fact)
    assert fact.at == ["3.4"]
    assert type(entry) is Entry
    assert source.facts() == [fact]


def test_every_source_is_accepted_and_its_studies_are_known():
    facts = [fact for source in sources() for fact in source.facts()]
    assert len({source.title for source in sources()}) == 3
    assert facts
    assert {fact.study for fact in facts} <= set(STUDIES)
    entries = [entry for source in sources() for some in source.sections.values() for entry in some]
    for study, figure in (name.split("/") for entry in entries for name in entry.figures):
        assert figure in study_named(study).figures, f"{study}/{figure}"
    for name in STUDIES:
        study = study_named(name)
        for fact in facts_of(name):
            assert not fact.find or fact.find in study.finds, f"{name}/{fact.name}"
            for column in (one.of for one in fact.parts if isinstance(one.of, str)):
                moments = {one.moment for one in fact.parts if one.of == column}
                assert moments == {study.moments.get(column, "")}, f"{name}/{fact.name}"
