"""Judges of the stability tables agree with the thesis on the thesis' own numbers."""

from __future__ import annotations

from dataclasses import replace

from cdpr_drake.analyses.reporting.statements import IN_PART, NOT_CONFIRMED, NOT_IN_QUICK
from cdpr_drake.analyses.studies.control_stability.statements import CHECKS
from cdpr_drake.analyses.studies.control_stability.study import STUDY
from cdpr_drake.analyses.studies.control_stability.tables import SHARE
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.statement import MET_FITTED, SOURCE, judged
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.framework.summary import COARSE, FULL
from cdpr_drake.analyses.studies.published.recipe_choices import chosen_on
from cdpr_drake.analyses.studies.published.stability_tables import TABLES

PLANNED = STUDY.planned(Form())


def printed_rows(change=lambda share: share, grid=FULL):
    """Rows in which every printed share is found, or something else in its place."""
    rows = [
        Run(
            f"{table.name} {bound}={value:g}", None,
            {"table": table.name, "bound": bound, "value": value, "grid": grid},
            {"sampled_percent": change(share)}, {"sampled_percent": f"{share:g}"},
        )
        for table in TABLES
        for bound, values in table.rows.items()
        for value, share in values.items()
    ]  # fmt: skip
    return Runs(rows, lambda: PLANNED)


def test_printed_numbers_confirm_all_but_what_a_table_contradicts():
    said = {s.name: s for s in judged(CHECKS, printed_rows())}
    assert len(said) == len(CHECKS) == len(TABLES) + 6
    assert {name for name, s in said.items() if s.verdict != MET_FITTED} == {"anchors_more"}
    assert said["anchors_more"].verdict == IN_PART
    assert "0.394, 0.295, 0.113 m^3" in said["image_based_largest"].found


def test_numbers_upside_down_confirm_no_table():
    rows = printed_rows(lambda share: (share + 50.0) % 100.0)
    said = {s.name: s for s in judged(CHECKS, rows)}
    tables = [one for name, one in said.items() if name.startswith("table_")]
    assert {one.verdict for one in tables} == {NOT_CONFIRMED}


def test_rows_that_are_not_there_are_no_confirmation():
    runs = printed_rows()
    some = [run for run in runs if run["table"] == "A.8" and run["bound"] != "r_s"]
    assert judged(CHECKS, Runs(some, runs.planned), complete=False) == []


def test_no_effect_of_any_error_meets_no_table_not_even_in_part():
    # Every row as at the baseline: rows of errors that the thesis finds harmless are met by that.
    rows = [
        replace(run, measured={"sampled_percent": next(iter(table.rows[run["bound"]].values()))})
        for table in TABLES
        for run in printed_rows()
        if run["table"] == table.name
    ]
    said = {s.name: s for s in judged(CHECKS, Runs(rows, lambda: PLANNED))}
    tables = [one for name, one in said.items() if name.startswith("table_")]
    assert {one.verdict for one in tables} == {NOT_CONFIRMED}
    assert {(one.of, one.cause) for one in tables} == {(1, SOURCE)}


def test_that_bounds_were_tested_farther_on_the_larger_robot_is_no_finding():
    # Nothing empties any workspace, and the larger robot keeps no more than the small one.
    said = {s.name: s for s in judged(CHECKS, printed_rows(lambda share: 50.0))}
    assert said["scales"].verdict == NOT_CONFIRMED
    assert said["scales"].of == 9


def test_coarse_grids_are_not_judged_but_named():
    said = judged(CHECKS, printed_rows(grid=COARSE), quick=True)
    assert {s.verdict for s in said} == {NOT_IN_QUICK}
    assert said[0].words.startswith("Table A.8")
    assert said[0].name == "table_a8"


def test_the_full_form_has_every_printed_row_and_what_is_covered():
    cases = STUDY.plan(Form())
    printed = [case for case in cases if case.printed]
    assert len(printed) == sum(table.size for table in TABLES) == 468
    assert {case.keys["bound"] for case in cases if not case.printed} == {SHARE}
    alike = [case for case in cases if case.same_task]
    assert 0 < len(alike) < len(cases) / 2


def test_which_rows_the_recipe_was_chosen_on():
    assert chosen_on("A.10", "r_A", 0.1)
    assert chosen_on("A.15", "r_bp", 1.0)
    assert chosen_on("A.11", "r_bp", 0.03)
    assert chosen_on("A.11", "r_A", 0.1)
    assert chosen_on("A.11", "r_bp", 0.1)
    assert not chosen_on("A.16", "r_bp", 0.1)
    assert not chosen_on("A.13", "d_theta_pc_deg", 40.0)
