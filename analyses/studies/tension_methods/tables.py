"""Tables of the study of tension methods."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import Statement, new_table, statement_table
from cdpr_drake.analyses.studies.tension_methods.coverage import MethodCoverage
from cdpr_drake.analyses.studies.tension_methods.experiments import (
    EXPERIMENTS,
    THESIS_START,
    TensionPlan,
)
from cdpr_drake.analyses.studies.tension_methods.trial import TrialResult

_STATEMENT_CAPTION = (
    "A verdict is about the words. The printed tensions are not reproduced: here the exact "
    "model follows the trajectory from its start; why the thesis' differ is known in part."
)


def study_tables(
    plan: TensionPlan,
    runs: Sequence[TrialResult],
    coverage: Sequence[MethodCoverage],
    statements: Sequence[Statement],
) -> list[Table]:
    """A table per experiment, per grid and of the statements; empty ones are left out."""
    tables = []
    for name, meaning in EXPERIMENTS.items():
        some = [run for run in runs if run.spec.experiment == name]
        if some:
            tables.append(_run_table(f"{name}: {meaning}", some))
            if name == "thesis":
                tables[-1].caption = _shift_words(plan)
    for robot in dict.fromkeys(row.robot for row in coverage):
        tables.append(_coverage_table([row for row in coverage if row.robot == robot]))
    if statements:
        tables.append(
            statement_table("What the Gazebo thesis states", statements, _STATEMENT_CAPTION)
        )
    return tables


def _shift_words(plan: TensionPlan) -> str:
    path = plan.path
    return (
        f"The printed start {THESIS_START} m cannot be held. It was moved {path.start_shift:.3f} m "
        f"straight towards home; {path.start_limit:.4f} m is the least. "
        f"The printed end was moved {path.end_shift:.3f} m."
    )


def _run_table(title: str, runs: Sequence[TrialResult]) -> Table:
    table = new_table(
        title,
        ("method", "out of bounds"),
        ("Kp", "error max [um]", "mean [um]", "tension max [N]", "min [N]", "jump [N]", "negative",
         "failures", "fell [s]"),
    )  # fmt: skip
    for run in runs:
        table.add_row(
            run.spec.method,
            str(run.spec.applied),
            f"{run.spec.stiffness:g}",
            "-" if run.lost else f"{1e6 * run.largest_error:.3g}",
            "-" if run.lost else f"{1e6 * run.mean_error:.3g}",
            f"{run.largest_tension:.2f}",
            f"{run.smallest_tension:.2f}",
            f"{run.largest_jump:.2g}",
            str(run.negative_tensions),
            f"{run.failures}/{run.steps}",
            f"{run.end_time:.2f}" if run.lost else "",
        )
    return table


def _coverage_table(rows: Sequence[MethodCoverage]) -> Table:
    first = rows[0]
    table = new_table(
        f"{first.robot}: {first.feasible} of {first.poses} poses can be held",
        ("method",),
        ("solved", "wrong verdicts", "mean largest tension [N]", "call [us]", "kernel [us]"),
    )
    for row in rows:
        mean = row.mean_largest_tension
        table.add_row(
            row.method,
            f"{100.0 * row.share:.1f} %",
            str(row.wrong),
            f"{mean:.2f}" if np.isfinite(mean) else "-",
            f"{row.microseconds:.1f}",
            f"{row.kernel_microseconds:.2f}",
        )
    return table
