"""What predictive control is in the summary of a run."""

from __future__ import annotations

from cdpr_drake.analyses.runs.run import Subject

SUBJECTS = (Subject("controller", lambda run: "predictive"),)
"""What a run reports of the section: the name of the controller."""
