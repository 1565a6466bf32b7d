"""All judges of the study."""

from __future__ import annotations

from cdpr_drake.analyses.studies.mobile_robot import slack_statements, statements

CHECKS = (*statements.CHECKS, *slack_statements.CHECKS)
"""Of laps, lengths and paths, then of slack."""
