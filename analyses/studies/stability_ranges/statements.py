"""Everything that the servoing thesis states about stability ranges."""

from __future__ import annotations

from collections.abc import Sequence

from cdpr_drake.analyses.reporting import Statement
from cdpr_drake.analyses.studies.stability_ranges import (
    planar_statements,
    single_statements,
    spatial_statements,
)
from cdpr_drake.analyses.studies.stability_ranges.answers import FoundRows
from cdpr_drake.analyses.studies.stability_ranges.item import RangeRow


def range_statements(rows: Sequence[RangeRow]) -> list[Statement]:
    """The statements whose rows are there, in the order of the thesis."""
    at_hand = FoundRows(rows)
    statements = []
    for judges in (planar_statements.JUDGES, spatial_statements.JUDGES, single_statements.JUDGES):
        for judge in judges:
            try:
                statements.append(judge(at_hand))
            except KeyError:  # a row was not computed
                continue
    return statements
