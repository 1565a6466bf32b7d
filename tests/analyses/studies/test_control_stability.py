"""Control stability workspaces: what facts say of made-up rows, equal calls, rows of few poses."""

import pandas as pd
import pytest

from cdpr_drake.analyses.studies.control_stability import (
    STUDY,
    cases,
    points_together,
    sampled_row,
    verdict_row,
)
from cdpr_drake.analyses.studies.control_stability_figures import reasons, recipe_means, rule_means
from cdpr_drake.analyses.studies.facts import facts_of, judged
from cdpr_drake.analyses.studies.recipe_variants import IN_USE, RECIPES
from cdpr_drake.analyses.studies.rows import digest
from cdpr_drake.analyses.studies.stability_recipe import SampledTask
from cdpr_drake.analyses.studies.stability_tables import BY_NAME, TABLES
from cdpr_drake.analyses.studies.study import Form, StudyResult

MET = "met (fitted)"


def rows_of(question, share=lambda table, bound, value, printed: printed, **about):
    """Rows of all tables; their shares are the printed ones, or something else."""
    column = {"verdicts": "sampled_percent", "row": "corners_percent"}[question]
    return pd.DataFrame([
        {
            "question": question, **about, "table": table.name, "robot": table.robot,
            "scheme": table.scheme, "bound": bound, "value": value, "printed_percent": printed,
            column: share(table, bound, value, printed),
        }
        for table in TABLES
        for bound, shares in table.rows.items()
        for value, printed in shares.items()
    ])  # fmt: skip


def verdicts(rows):
    found = judged(facts_of("control-stability"), rows, STUDY.finds, {}, "")
    return {one["name"]: one["verdict"] for one in found if one["verdict"] != "not judged"}


def tables_in(found):
    return {verdict for name, verdict in found.items() if name.startswith("table_")}


def test_printed_shares_confirm_all_but_what_a_table_contradicts():
    found = verdicts(rows_of("verdicts"))
    assert {name for name, verdict in found.items() if verdict == "in part"} >= {"anchors_more"}
    assert tables_in(found) == {MET}
    for name in ("platform_size", "camera_least", "scales", "hybrid_larger", "image_based_largest"):
        assert found[name] == MET


@pytest.mark.parametrize(
    "share",
    [
        lambda table, bound, value, printed: (printed + 50.0) % 100.0,
        # Every row as at the baseline: rows of errors that do no harm are met by that.
        lambda table, bound, value, printed: next(iter(table.rows[bound].values())),
    ],
    ids=["upside down", "no effect of any error"],
)
def test_other_shares_meet_no_table_not_even_in_part(share):
    assert tables_in(verdicts(rows_of("verdicts", share))) == {"not confirmed"}


def test_that_bounds_were_tested_farther_on_the_larger_robot_is_no_finding():
    assert verdicts(rows_of("verdicts", lambda *row: 50.0))["scales"] == "not confirmed"


def test_printed_shares_alone_contradict_each_other():
    found = verdicts(rows_of("verdicts"))
    assert {name: found[name] for name in ("shifts", "common_exits", "rising")} == {
        "shifts": "in part", "common_exits": "in part", "rising": "confirmed"
    }  # fmt: skip


def recipe_rows(share, limits=()):
    """Rows of the recipe in use, and what any target leaves of others."""
    rows = rows_of("row", share, recipe=IN_USE.name, fitted=True)
    names = ["table", "bound", "value", "printed_percent", "at_most_percent", "arrangement"]
    limits = [("A.11", "r_B", 0.0, 0.0, 100.0, "present"), *limits]
    more = pd.DataFrame(limits, columns=names).assign(question="any target")
    return pd.concat([rows, more], ignore_index=True)


def off(name, *bounds):
    """Nothing is left in rows of some bounds of a table."""
    return lambda table, bound, value, printed: (
        0.0 if table.name == name and bound in bounds else printed
    )


def test_a_table_is_explained_by_bounds_that_are_ruled_out_and_by_nothing_else():
    assert reasons(recipe_rows(off("", ""))) == []
    [reason] = reasons(recipe_rows(off("A.15", "r_A", "r_B")))
    assert set(reason["rows"]) == {"r_A"}  # from printed numbers alone
    assert not reason["explained"]
    limit = ("A.15", "r_B", 0.4, 64.0, 0.0, "present")
    [reason] = reasons(recipe_rows(off("A.15", "r_A", "r_B"), [limit]))
    assert reason["rows"]["r_B"] == "0.4 m prints 64.0, any target leaves 0.0"
    assert (reason["explained"], reason["rest"]) == (True, 0.0)
    [reason] = reasons(recipe_rows(off("A.15", "r_bp"), [limit]))
    assert not reason["explained"]  # what is missed is another bound
    # What other anchor points exclude does not count for the recipe's own.
    limit = ("A.11", "r_B", 0.05, 52.1, 0.0, "present")
    [reason] = reasons(recipe_rows(off("A.11", "r_A", "r_B"), [limit]))
    assert reason["rows"] == {}


def test_points_are_wrong_together_only_if_one_way_gives_both_kinds():
    ways = ("common", "corners", "independent", "single")
    half = {"common": off("A.10", "r_A"), "single": off("A.10", "r_B")}
    nothing = off("A.10", "r_A", "r_B")
    rows = pd.concat(
        rows_of("row", half.get(way, nothing), recipe=f"points-{way}", fitted=way == "common")
        for way in ways
    )
    held, _ = points_together(rows)
    assert [name for name, good in zip(BY_NAME, held, strict=True) if not good] == ["A.10"]
    assert recipe_means(rows)["A.9"].tolist() == [0.0] * 4
    assert rule_means(by_rules(rows))["in sight"].notna().sum() == 1


def by_rules(rows):
    more = {f"{rule}_percent": rows["corners_percent"] for rule in ("cell_hulls", "points")}
    return rows.assign(**more)


def test_one_recipe_alone_has_its_means_and_judges_nothing():
    records = by_rules(rows_of("row", recipe=IN_USE.name, fitted=True)).to_dict("records")
    result = StudyResult(STUDY, Form(recipe=IN_USE.name), records, len(records))
    found = result.as_dict()
    assert found["statements"] == []
    assert set(found["parameters"]["recipes"]) == {IN_USE.name}
    assert found["numbers"]["mean_absolute_difference_points"][IN_USE.name]["points"]["A.8"] == 0.0
    assert [title.partition(",")[0] for title in result.tables()] == [
        "Mean absolute difference by recipe and table",
        "Mean absolute difference by recipe and rule of the volume",
        "Printed rows of exit points beside rows of the platform's place",
        "Tables above 5 points",
    ]


def test_the_full_form_has_every_row_and_equal_calls_are_one():
    rows = [(case.keys, digest(call)) for case in cases(Form()) for _, call in case.calls()]
    verdict_rows = [keys for keys, _ in rows if keys["question"] == "verdicts"]
    assert sum(keys["printed_percent"] is not None for keys in verdict_rows) == 468
    by_recipe = [one for one in rows if one[0]["question"] == "row"]
    assert len(by_recipe) == 468 * len(RECIPES)
    assert len({name for _, name in by_recipe}) < len(by_recipe) / 3
    limits = [keys["table"] for keys, _ in rows if keys["question"] == "any target"]
    assert "A.8" not in limits
    one = [keys for case in cases(Form(recipe="caroca-single")) for keys, _ in case.calls()]
    assert {keys["recipe"] for keys in one} == {"caroca-single"}


def test_verdicts_imply_each_other_and_samples_are_those_of_recipes():
    calls = (case.call for case in cases(Form(quick=True)) if case.keys["bound"] == "r_B")
    task, full = next(calls).args
    row = verdict_row(task, full)
    assert row["ordered"]
    assert row["certified_poses"] <= row["searched_poses"] <= row["sampled_poses"] <= row["poses"]
    same = sampled_row(SampledTask(task.case, task.bounds, task.grid, task.options), full)
    assert same["corners_percent"] == row["sampled_percent"]
    assert same["cell_hulls_percent"] >= same["corners_percent"]
