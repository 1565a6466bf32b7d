"""All judges of the study."""

from __future__ import annotations

from cdpr_drake.analyses.studies.mobile_robot import slack_statements, statements

JUDGES = (*statements.JUDGES, *slack_statements.JUDGES)
"""Of laps, lengths and paths, then of slack."""
