"""What was exchanged with a process outside, in the summary of a run."""

from __future__ import annotations

from cdpr_drake.analyses.runs.run import Subject

SUBJECTS = (Subject("remote", lambda run: run.built.outside.report()),)
"""What a run reports of the section."""
