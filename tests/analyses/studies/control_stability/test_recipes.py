"""Variants of the recipe: what each changes, and that one command evaluates and continues one."""

import json
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.statements import NOT_IN_QUICK
from cdpr_drake.analyses.studies.control_stability import study as original
from cdpr_drake.analyses.studies.control_stability.all_recipes import STUDY as ALL
from cdpr_drake.analyses.studies.control_stability.arrangements import ARRANGEMENTS
from cdpr_drake.analyses.studies.control_stability.exchanges import (
    PAIRS,
    exchange_means,
    other_rows,
)
from cdpr_drake.analyses.studies.control_stability.printed_limits import (
    covering_pairs,
    excluded,
    nested_pairs,
    rising_rows,
)
from cdpr_drake.analyses.studies.control_stability.recipes import (
    ANY_TARGET,
    ARRANGED,
    EXCHANGED,
    ROW,
    RULES,
    difference,
    recipe_study,
)
from cdpr_drake.analyses.studies.control_stability.table_reasons import table_reasons
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Run, Runs
from cdpr_drake.analyses.studies.framework.study import Case, Form
from cdpr_drake.analyses.studies.framework.summary import COARSE
from cdpr_drake.analyses.studies.published.recipe_variants import (
    EXCHANGE,
    IN_USE,
    OTHER_ANCHORS,
    PRESENT,
    RECIPES,
    exchanged_anchors,
)
from cdpr_drake.analyses.studies.published.stability_recipe import (
    recipe_bounds,
    recipe_case,
    recipe_grid,
    recipe_options,
)
from cdpr_drake.analyses.studies.published.stability_tables import TABLES
from cdpr_drake.cli.app import main
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.stability.desired_view import OppositeCorner
from cdpr_drake.stability.verdict import judge_stability
from tests.messages import printed

FULLY = "acrobot_fully_constrained"
TABLE = {table.name: table for table in TABLES}
A11 = TABLE["A.11"]


def test_arrangements_of_cables_are_what_they_are_called():
    before, upper, other, kept = (
        RECIPES[name].cables(FULLY)
        for name in ("present", "upper-on-upper", "other-corners-independent", "kept-cables")
    )
    assert {*map(tuple, upper.p_PB.T)} == {*map(tuple, before.p_PB.T)}
    above = upper.p_WA[2] > 1.0
    np.testing.assert_array_equal(above, upper.p_PB[2] > 0.05)
    assert not np.any(above == (before.p_PB[2] > 0.05))  # by the numbers it is the other way round
    np.testing.assert_array_equal(np.sign(upper.p_PB[0]), np.sign(upper.p_WA[0]))
    np.testing.assert_array_equal(np.sign(upper.p_PB[1]), -np.sign(upper.p_WA[1]))
    np.testing.assert_array_equal(upper.p_WA, before.p_WA)
    np.testing.assert_array_equal(upper.p_PB * [[-1], [-1], [1]], other.p_PB)  # opposite corners
    large = PRESENT.cables("acrobot_large")
    assert {(*a[:2], *b) for a, b in zip(kept.p_WA.T, kept.p_PB.T, strict=True)} == {
        (*a[:2], *b) for a, b in zip(large.p_WA.T, large.p_PB.T, strict=True)
    }


def test_an_exchange_moves_two_cables_from_above_and_nothing_else():
    before, after = PRESENT.cables(FULLY), IN_USE.cables(FULLY)
    np.testing.assert_array_equal(after.p_WA, before.p_WA)
    moved = np.flatnonzero(np.any(after.p_PB != before.p_PB, axis=0))
    assert tuple(moved) == EXCHANGE
    assert np.all(before.p_WA[2, moved] > 1.0)
    np.testing.assert_array_equal(after.p_PB[:, moved], before.p_PB[:, moved[::-1]])
    # As if the two exit points were printed in each other's place.
    exits = exchanged_anchors(after, *EXCHANGE)
    np.testing.assert_array_equal(exits.p_PB, before.p_PB)
    same = exchanged_anchors(before, 3, 3)
    np.testing.assert_array_equal(same.p_PB, before.p_PB)


def test_the_fully_constrained_robot_alone_goes_to_the_centre():
    case = recipe_case(FULLY, "pbvs")
    np.testing.assert_allclose(case.target.place, [0.0, 0.0, 0.55], atol=1e-12)
    corner = recipe_case("acrobot_large", "pbvs").target
    np.testing.assert_allclose(corner.place, [-0.48, -0.48, 0.0], atol=1e-12)


def test_rows_of_one_bound_choose_the_exchange():
    """On every eighth column of the grid: one exchange or its mirror image, far before others."""
    grid = recipe_grid(FULLY)
    axes = [grid.axes[0][4::8], grid.axes[1][4::8], grid.axes[2]]
    poses = np.array([[1, 0, 0, 0, x, y, z] for x in axes[0] for y in axes[1] for z in axes[2]])
    options = recipe_options(FULLY)
    means = {}
    for pair in ((0, 0), (1, 7), (3, 5), (0, 6), (2, 4), (0, 1)):
        cables = exchanged_anchors(PRESENT.cables(FULLY), *pair)
        case = replace(recipe_case(FULLY, "pbvs"), cables=cables)
        apart = []
        for value in (0.03, 0.05, 0.2):
            bounds = recipe_bounds(A11, "r_bp", value)
            stable = judge_stability(case, bounds, poses, "sampled", options).stable
            apart.append(abs(100.0 * np.mean(stable) - A11.rows["r_bp"][value]))
        means[pair] = float(np.mean(apart))
    best = sorted(means, key=means.__getitem__)[:2]
    assert set(best) == {(1, 7), (3, 5)}
    assert max(means[pair] for pair in best) + 5.0 < min(means[p] for p in means if p not in best)


def test_an_exchange_is_judged_by_the_rows_that_did_not_choose():
    apart = {"A2 A8": 3.0, "none": 20.0}
    rows = [
        Run(
            f"{number} {value}", None,
            {"question": EXCHANGED, "exchange": name, "value": value},
            {"box_percent": printed - apart.get(name, 15.0)}, {"box_percent": f"{printed:g}"},
        )
        for number, name in enumerate(("A2 A8", "none", *map(str, range(2, len(PAIRS)))))
        for value, printed in A11.rows["r_bp"].items()
    ]  # fmt: skip
    means = exchange_means(Runs(rows))
    assert means["A2 A8"] == pytest.approx(3.0)
    assert next(iter(means)) == "A2 A8"
    assert next(reversed(means)) == "none"
    with pytest.raises(MissingRuns):
        exchange_means(Runs(rows[:-1]))
    rest = other_rows(rows_of(A11, {"r_bp": 0.0, "r_B": 90.0}))
    assert len(rest) == A11.size - 6 - 5  # without r_bp, and the baseline of five bounds
    assert max(rest) == pytest.approx(90.0)  # r_B = 0.1 m prints 0


def test_recipes_differ_in_what_they_name():
    for table in TABLES:
        one, other = (
            recipe_case(table.robot, table.scheme, recipe)
            for recipe in (PRESENT, RECIPES["points-common"])
        )
        np.testing.assert_array_equal(one.cables.p_PB, other.cables.p_PB)
        assert recipe_bounds(table, "r_A", 0.1) == recipe_bounds(table, "r_A", 0.1, IN_USE)


@pytest.mark.parametrize(
    ("name", "table", "exits", "anchors"),
    [
        ("present", "A.11", "corners", None),
        ("upper-on-upper-independent", "A.11", "independent", None),
        ("upper-on-upper-independent", "A.9", "corners", None),
        ("hybrid-exits-independent", "A.14", "independent", "corners"),
        ("hybrid-exits-independent", "A.10", "corners", None),
        ("caroca-single", "A.12", None, "single"),
        ("caroca-single", "A.15", None, "common"),
    ],
)
def test_points_of_a_scheme_and_bound_come_before_those_of_a_robot(name, table, exits, anchors):
    for bound, kind, expected in (("r_A", "exits", exits), ("r_B", "anchors", anchors)):
        found = getattr(recipe_bounds(TABLE[table], bound, 0.1, RECIPES[name]), kind)
        assert expected in (None, found)


def some_of(study, *asked, chunk=20):
    """A study of the cases whose keys have one of some sets of values, without those whose task
    another case has."""

    def cases(form):
        found = [
            case
            for case in study.cases(form)
            if any(where.items() <= case.keys.items() for where in asked)
        ]
        there = {case.name for case in found}
        return [case for case in found if case.same_task in ("", *there)]

    return replace(study, cases=cases, chunk=chunk)


CHOOSING = {"table": "A.11", "bound": "r_bp"}


def test_a_recipe_continues_and_gives_what_the_study_gives(tmp_path):
    study = some_of(
        recipe_study(IN_USE), CHOOSING, {"table": "A.11", "bound": "r_pc", "value": 0.01}
    )
    asked = iter(range(3))
    session = StudySession(tmp_path / "r", should_stop=lambda: next(asked, None) is None, workers=1)
    assert study(quick=True, session=session).interrupted
    found = study(quick=True, session=StudySession(tmp_path / "r", workers=1))
    assert found.progress.found > 0
    assert found.runs.list("fitted") == [True] * 7
    baseline, again = found.runs.rows[0], found.runs.rows[-1]
    assert baseline.measured == again.measured  # the baseline, computed once
    assert found.cases[-1].same_task == found.cases[0].name
    assert np.isnan(difference(found.runs, fitted=False))
    for run in found.runs:
        assert run["corners_percent"] <= run["cell_hulls_percent"] + 1e-9
    grid = recipe_grid(FULLY, quick=True)
    task = original.VerdictsTask(
        recipe_case(FULLY, "pbvs"), recipe_bounds(A11, "r_bp", 0.1), grid, recipe_options(FULLY)
    )
    keys = {"table": "A.11", "grid": COARSE}
    case = Case(name="r_bp=0.1", keys=keys, data=grid.shape, items=grid.size)
    row = original.stability_row(case, task(0, grid.size))
    [mine] = found.runs(bound="r_bp", value=0.1)
    assert mine["corners_percent"] == pytest.approx(row["sampled_percent"], abs=1e-12)
    found.write(tmp_path)
    read = json.loads((tmp_path / "results.json").read_text())
    assert read["parameters"]["recipe"]["name"] == IN_USE.name
    assert set(read["numbers"]["mean_absolute_difference_points"]) == set(RULES)
    [table] = found.tables()
    assert table.row_count == 1
    assert str(table.caption).endswith("Coarse grid: the differences mean little.")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["control-stability", "--recipe", "presnt"], "'presnt' is unknown; did you mean"),
        (["case-8", "--recipe", "present"], "accepted with control-stability, not with case-8"),
    ],
)
def test_wrong_recipes_are_refused(capsys, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["study", *arguments])
    assert ended.value.code == 2
    assert words in printed(capsys).err
    assert list(tmp_path.iterdir()) == []


def test_mounting_and_goal_of_a_recipe_are_those_of_its_case():
    case = recipe_case("acrobot_large", "pbvs", RECIPES["camera-as-built"])
    np.testing.assert_allclose(case.X_PC.translation(), [-0.0631, 0.0, 0.01])
    np.testing.assert_allclose(case.X_PC.rotation().matrix()[:, 2], [0.0, 0.0, -1.0], atol=1e-12)
    down = recipe_case("caroca", "2.5d")
    np.testing.assert_allclose(down.X_PC.rotation().matrix(), np.diag([1, -1, -1]), atol=1e-12)
    np.testing.assert_array_equal(down.X_PC.translation(), [0.0, 0.0, 0.2])
    assert isinstance(
        recipe_case("caroca", "pbvs", RECIPES["opposite-corner"]).target, OppositeCorner
    )


def test_an_error_of_exit_points_contains_a_shift_of_the_platform():
    pairs = [pair for table in TABLES for pair in nested_pairs(table)]
    bad = {(pair.table, pair.r_A, pair.r_bp) for pair in pairs if pair.contradictory}
    assert bad == {("A.15", 0.05, 0.05), ("A.18", 0.3, 0.3)}
    # With points that share one shift the same rows are the same sets, up to the draws.
    cables = load_robot("acrobot_large").cable_set().without_pulleys()
    shift = np.array([0.02, -0.01, 0.03])
    exits = replace(cables, p_WA=cables.p_WA - shift[:, np.newaxis])
    np.testing.assert_allclose(
        cable_jacobian(RigidTransform(shift), cables), cable_jacobian(RigidTransform(), exits)
    )


def test_printed_rows_that_a_common_shift_of_exit_points_cannot_give():
    less = {table.name: [p for p in covering_pairs(table) if p.less] for table in TABLES}
    assert [(p.r_A, p.r_bp) for p in less["A.15"]] == [(0.2, 0.25), (0.3, 0.5)]
    assert (0.2, 0.25) in [(p.r_A, p.r_bp) for p in less["A.12"]]
    assert [row for table in TABLES for row in rising_rows(table)] == []
    upwards = replace(A11, rows={"r_bp": {0.1: 30.0, 0.03: 97.0, 0.2: 30.5}})
    assert rising_rows(upwards) == [("r_bp", 0.1, 0.2)]


def rows_of(table, shares):
    """Rows of a table with the shares given by bound, others as printed."""
    return Runs(
        [
            Run(
                f"{bound}={value:g}", None,
                {"table": table.name, "bound": bound, "value": value},
                {"corners_percent": shares.get(bound, printed)},
                {"corners_percent": f"{printed:g}"},
            )
            for bound, rows in table.rows.items()
            for value, printed in rows.items()
        ]
    )  # fmt: skip


def limit(table, bound, value, printed, at_most, arrangement="present"):
    """What any target leaves of a row."""
    keys = {"table": table, "bound": bound, "value": value, "arrangement": arrangement}
    words = {"at_most_percent": f"{printed:g}"}
    return Run(f"{bound}={value:g}", None, keys, {"at_most_percent": at_most}, words)


def test_a_table_is_explained_by_bounds_that_are_ruled_out_and_by_nothing_else():
    table = TABLE["A.15"]
    [reason] = table_reasons(IN_USE, rows_of(table, {"r_A": 0.0, "r_B": 0.0}), Runs(()))
    assert set(reason.rows) == {"r_A"}  # from printed numbers alone
    assert not reason.explained
    limits = Runs([limit("A.15", "r_B", 0.4, 64.0, 0.0), limit("A.15", "r_B", 0.005, 94.0, 100.0)])
    [reason] = table_reasons(IN_USE, rows_of(table, {"r_A": 0.0, "r_B": 0.0}), limits)
    assert reason.rows["r_B"] == "0.4 m prints 64.0, any target leaves 0.0"
    assert reason.explained
    assert reason.rest == 0.0
    [reason] = table_reasons(IN_USE, rows_of(table, {"r_bp": 0.0}), limits)
    assert not reason.explained  # what is missed is another bound
    assert table_reasons(IN_USE, rows_of(table, {}), limits) == []
    # What other anchor points exclude does not count for the recipe's own.
    limits = Runs([limit("A.11", "r_B", 0.05, 52.1, 0.0)])
    [reason] = table_reasons(IN_USE, rows_of(A11, {"r_B": 0.0, "r_A": 0.0}), limits)
    assert reason.rows == {}


def test_all_recipes_are_one_study_and_rows_alike_are_computed_once():
    cases = ALL.plan(Form(quick=True))
    count = Counter(case.keys["question"] for case in cases)
    limits = sum(len(A11.rows[bound]) for bound in ("r_A", "r_B"))
    assert count == {
        ROW: len(RECIPES) * A11.size,
        ANY_TARGET: (1 + len(OTHER_ANCHORS)) * limits,
        ARRANGED: len(ARRANGEMENTS),
        EXCHANGED: len(PAIRS) * len(A11.rows["r_bp"]),
    }
    first = {case.keys["recipe"]: case for case in cases if case.keys["question"] == ROW}
    # On this robot the recipe asks what `present` does, and so computes nothing.
    mine = [case for case in cases if case.keys.get("recipe") == "caroca-single"]
    assert all(case.same_task.startswith("present A.11") for case in mine)
    assert set(first) == set(RECIPES)


def test_the_full_form_has_every_row_by_every_recipe():
    cases = ALL.plan(Form())
    rows = Counter(case.keys["recipe"] for case in cases if case.keys["question"] == ROW)
    assert rows == dict.fromkeys(RECIPES, 468)
    limits = [case for case in cases if case.keys["question"] == ANY_TARGET]
    assert "A.8" not in {case.keys["table"] for case in limits}
    # What any target leaves is the same for every scheme; these have values that PBVS has not.
    first = {case.keys["table"] for case in limits if case.task}
    assert {"A.9", "A.10", "A.11", "A.12"} <= first < {case.keys["table"] for case in limits}


def test_what_recipes_are_held_against_is_computed_and_told(tmp_path):
    names = ("present", "other-corners-independent")
    found = some_of(
        ALL,
        *({"question": ROW, "recipe": name, "bound": "r_A", "value": 0.005} for name in names),
        {"question": ANY_TARGET, "bound": "r_B", "value": 0.05},
        {"question": ARRANGED, "anchors": "upper, opposite; other x"},
        {"question": EXCHANGED, "exchange": "none", "value": 0.03},
        chunk=2000,
    )(quick=True, session=StudySession(workers=1))
    assert not found.interrupted
    # Half a decimetre at each anchor point leaves no pose of the other arrangement.
    limits = found.runs(question=ANY_TARGET)
    assert names[1] in {run["arrangement"] for run in limits if excluded(run)}
    assert all(0.0 <= run["box_percent"] <= 100.0 for run in found.runs(question=EXCHANGED))
    assert [statement.name for statement in found.statements] == [
        "best_recipe", "unseen_rows", "reasons", "spheres", "shifts", "common_exits", "rising",
        "points_together", "anchor_points", "exchanged_cables",
    ]  # fmt: skip
    judged = {one.name for one in found.statements if one.verdict != NOT_IN_QUICK}
    assert judged == {"shifts", "common_exits", "rising"}  # from printed numbers alone
    tables = found.tables()
    assert tables[0].row_count == len(names) + 1
    assert {"Coarse grid" in str(tables[number].caption) for number in (0, 1, 2, 3, 5)} == {True}
    assert "Coarse grid" not in str(tables[4].caption)  # nor is a grid in it
    found.write(tmp_path)
    told = json.loads((tmp_path / "results.json").read_text())
    assert {pair["table"] for pair in told["numbers"]["nested_rows"]} >= {"A.15", "A.18"}
    assert len((tmp_path / "runs.csv").read_text().splitlines()) == len(found.runs) + 1
