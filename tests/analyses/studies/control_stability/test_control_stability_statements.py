"""Judges of the stability tables agree with the thesis on the thesis' own numbers."""

from __future__ import annotations

from cdpr_drake.analyses.reporting.statements import CONFIRMED, IN_PART, NOT_CONFIRMED, NOT_IN_QUICK
from cdpr_drake.analyses.studies.control_stability.statements import (
    CHECKS,
    control_stability_statements,
)
from cdpr_drake.analyses.studies.control_stability.tables import StabilityRow
from cdpr_drake.analyses.studies.published.recipe_choices import chosen_on
from cdpr_drake.analyses.studies.published.stability_tables import TABLES


def printed_rows(change=lambda share: share):
    """Rows in which every printed share is found, or something else in its place."""
    return [
        StabilityRow(
            table=table.name, bound=bound, value=value, published=share,
            shares=dict.fromkeys(("sampled", "searched", "certified"), change(share)), poses={},
            grid=1, ordered=True,
        )
        for table in TABLES
        for bound, values in table.rows.items()
        for value, share in values.items()
    ]  # fmt: skip


def test_printed_numbers_confirm_all_but_what_a_table_contradicts():
    said = {s.name: s for s in control_stability_statements(printed_rows(), quick=False)}
    assert len(said) == len(CHECKS) == len(TABLES) + 6
    assert {name for name, s in said.items() if s.verdict != CONFIRMED} == {"anchors_more"}
    assert said["anchors_more"].verdict == IN_PART
    assert "0.394, 0.295, 0.113 m^3" in said["image_based_largest"].found


def test_numbers_upside_down_confirm_no_table():
    rows = printed_rows(lambda share: (share + 50.0) % 100.0)
    said = {s.name: s.verdict for s in control_stability_statements(rows, quick=False)}
    assert {v for name, v in said.items() if name.startswith("table_")} == {NOT_CONFIRMED}


def test_rows_that_are_not_there_are_no_confirmation():
    some = [row for row in printed_rows() if row.table == "A.8" and row.bound != "r_s"]
    (said,) = control_stability_statements(some, quick=False)
    assert (said.name, said.verdict) == ("table_a8", IN_PART)


def test_coarse_grids_are_not_judged_but_named():
    said = control_stability_statements(printed_rows(), quick=True)
    assert {s.verdict for s in said} == {NOT_IN_QUICK}
    assert said[0].words.startswith("Table A.8")
    assert said[0].name == "table_a8"


def test_which_rows_the_recipe_was_chosen_on():
    assert chosen_on("A.10", "r_A", 0.1)
    assert chosen_on("A.15", "r_bp", 1.0)
    assert chosen_on("A.11", "r_bp", 0.03)
    assert chosen_on("A.11", "r_A", 0.1)
    assert chosen_on("A.11", "r_bp", 0.1)
    assert not chosen_on("A.16", "r_bp", 0.1)
    assert not chosen_on("A.13", "d_theta_pc_deg", 40.0)
