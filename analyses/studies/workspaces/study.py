"""The study."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cdpr_drake.analyses.studies.framework.study import Form, Study
from cdpr_drake.analyses.studies.workspaces.distances import SEED, TURN
from cdpr_drake.analyses.studies.workspaces.figures import FIGURES
from cdpr_drake.analyses.studies.workspaces.items import study_cases, workspace_row
from cdpr_drake.analyses.studies.workspaces.statements import CHECKS
from cdpr_drake.analyses.studies.workspaces.tables import figure_table, kind_table

CHUNK_POSES = 4096
"""Poses per chunk; seconds of work with stability, else milliseconds."""


def parameters(form: Form) -> Mapping[str, Any]:
    """Of the poses at which distances are compared."""
    return {"distances": {"seed": SEED, "turn_rad": TURN}}


STUDY = Study(
    name="workspaces",
    title="Where the robots that ship can work: every kind of workspace, and what checks it",
    source="servoing thesis 1.3.3, figures 1.17 and 1.18; Gazebo thesis 2.6",
    cases=study_cases,
    reduce=workspace_row,
    chunk=CHUNK_POSES,
    unit="poses",
    parameters=parameters,
    stated="What the theses state and what has to hold",
    checks=CHECKS,
    tables=[figure_table, kind_table],
    figures=FIGURES,
)
