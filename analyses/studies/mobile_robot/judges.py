"""All judges of the study."""

from __future__ import annotations

from cdpr_drake.analyses.reporting import Statement, judged, not_judged
from cdpr_drake.analyses.studies.mobile_robot import slack_statements, statements


def mobile_robot_statements(found: statements.Found) -> list[Statement]:
    """All statements for which there are runs, by the names of the configurations."""
    return judged((*statements.JUDGES, *slack_statements.JUDGES), found, not_judged)
