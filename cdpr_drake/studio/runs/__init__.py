"""Runs as the studio shows them, without the page: what is asked for, and what came out.

`ScenarioDraft` is a scenario with changed fields, checked as `cdpr simulate` does. `FinishedRun` is
the results folder of a run, to be looked at from row to row; `RunScene` draws a run into Meshcat.
Live samples and the rows of a log become the same rows of plots.
"""

from cdpr_drake.studio.runs.archive import zipped
from cdpr_drake.studio.runs.finished_run import FinishedRun, is_run
from cdpr_drake.studio.runs.plot_rows import Chart, charts_of, plot_row
from cdpr_drake.studio.runs.run_board import RUNS, RunBoard, Shown, key_of, outcome_words
from cdpr_drake.studio.runs.run_scene import RunScene
from cdpr_drake.studio.runs.scenario_draft import (
    COMMON,
    ROBOT,
    FormField,
    FormSection,
    ScenarioDraft,
)

__all__ = [
    "COMMON", "ROBOT", "RUNS", "Chart", "FinishedRun", "FormField", "FormSection", "RunBoard",
    "RunScene", "ScenarioDraft", "Shown", "charts_of", "is_run", "key_of", "outcome_words",
    "plot_row", "zipped",
]  # fmt: skip
