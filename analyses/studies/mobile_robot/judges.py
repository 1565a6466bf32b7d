"""All judges of the study."""

from __future__ import annotations

from cdpr_drake.analyses.reporting import Statement, judged_statements
from cdpr_drake.analyses.studies.mobile_robot import slack_statements, statements

JUDGES = (*statements.JUDGES, *slack_statements.JUDGES)
"""Of laps, lengths and paths, then of slack."""


def mobile_robot_statements(found: statements.Found, quick: bool = False) -> list[Statement]:
    """All statements for which there are runs, by the names of the configurations; of the `quick`
    form also the names of the others."""
    return judged_statements(JUDGES, found, quick)
