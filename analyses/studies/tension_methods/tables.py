"""Tables of the study of tension methods."""

from __future__ import annotations

from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.tension_methods.experiments import (
    EXPERIMENTS,
    THESIS_START,
    thesis_path,
)


def run_tables(runs: Runs) -> list[Table]:
    """A table for each experiment of which there are runs."""
    there = dict(runs.by("experiment"))
    tables = []
    for name, meaning in EXPERIMENTS.items():
        if name in there:
            tables.append(_run_table(f"{name}: {meaning}", there[name]))
            if name == "thesis":
                tables[-1].caption = _shift_words()
    return tables


def _shift_words() -> str:
    path = thesis_path()
    return (
        f"The printed start {THESIS_START} m cannot be held. It was moved {path.start_shift:.3f} m "
        f"straight towards home; {path.start_limit:.4f} m is the least. "
        f"The printed end was moved {path.end_shift:.3f} m."
    )


def _run_table(title: str, runs: Runs) -> Table:
    table = new_table(
        title,
        ("method", "out of bounds"),
        ("Kp", "error max [um]", "mean [um]", "tension max [N]", "min [N]", "jump [N]", "negative",
         "failures", "fell [s]"),
    )  # fmt: skip
    for run in runs:
        lost = run["lost"]
        table.add_row(
            run["method"],
            run["applied"],
            f"{run['kp_per_s2']:g}",
            "-" if lost else f"{1e6 * run['position_error_max_m']:.3g}",
            "-" if lost else f"{1e6 * run['position_error_mean_m']:.3g}",
            f"{run['tension_max_n']:.2f}",
            f"{run['tension_min_n']:.2f}",
            f"{run['tension_jump_max_n']:.2g}",
            str(run["negative_tensions"]),
            f"{run['failures']}/{run['control_steps']}",
            f"{run['end_time_s']:.2f}" if lost else "",
        )
    return table


def coverage_tables(coverage: Runs) -> list[Table]:
    """A table for each robot, of rows of `cover`."""
    tables = []
    for robot, rows in coverage.by("robot"):
        table = new_table(
            f"{robot}: {rows.rows[0]['feasible']} of {rows.rows[0]['poses']} poses can be held",
            ("method",),
            ("solved", "wrong verdicts", "mean largest tension [N]", "call [us]", "kernel [us]"),
        )
        for row in rows:
            mean = row["mean_largest_tension_n"]
            table.add_row(
                row["method"],
                f"{100.0 * row['share']:.1f} %",
                str(row["wrong"]),
                "-" if mean is None else f"{mean:.2f}",
                f"{row['call_us']:.1f}",
                f"{row['kernel_us']:.2f}",
            )
        tables.append(table)
    return tables
