"""The study."""

from __future__ import annotations

from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.study import Study
from cdpr_drake.analyses.studies.stability_bounds.figures import FIGURES, LABELS, tightness
from cdpr_drake.analyses.studies.stability_bounds.questions import (
    COSTS,
    METHODS,
    SHARES,
    cases,
    measure,
    parameters,
    reduce,
)
from cdpr_drake.analyses.studies.stability_bounds.statements import CHECKS

CHUNK = 75
"""Poses per chunk."""

ASSUMPTIONS = (
    "Robots, points of the cables and samples as in the study control-stability, see its recipe; "
    "the task is another: to the middle of the grid's box without a turn, where loops can go.",
    "Loops are the equation that the criterion bounds: no image, no masses, no slack cables, a "
    "constantly wrong model.",
    "Intervals and constants of Lipschitz are arrays of NumPy over many poses at once, the "
    "verdicts and the loops are compiled; times compare what is here, not what could be.",
)


def shares_table(runs: Runs) -> Table:
    """Shares of the box by robot, bounds and method."""
    table = new_table(
        "Stable share of the box in per cent",
        ("robot", "box", "bounds [D_b]"),
        (*(LABELS[name] for name in METHODS), "worst loop"),
    )
    for run in runs(experiment=SHARES):
        flat = "full_m2" in run.measured
        box = f"{run['full_m2']:.3g} m^2" if flat else f"{run['full_m3']:.3g} m^3"
        words = (f"{run[f'{name}_percent']:.1f}" for name in (*METHODS, "worst"))
        table.add_row(run["robot"], box, f"{run['scale']:g}", *words)
    return table


def costs_table(runs: Runs) -> Table:
    """Processor time for a pose, and how large errors are withstood beside the search."""
    table = new_table(
        "Processor time for a pose under D_b in ms; bounds withstood as a share of the search's, "
        "median over poses",
        ("robot", "number"),
        tuple(LABELS[name] for name in METHODS),
    )
    for run in runs(experiment=COSTS):
        robot = run["robot"]
        table.add_row(robot, "ms", *(f"{1e3 * run['seconds'][name]:.3g}" for name in METHODS))
        table.add_row(robot, "share", *(f"{tightness(runs, robot, name):g}" for name in METHODS))
    return table


def cut_table(runs: Runs) -> Table:
    """What intervals prove when their box is cut."""
    table = new_table(
        "Poses that intervals prove under a quarter of D_b, and with each axis cut in two",
        ("robot",),
        ("whole [%]", "cut [%]", "certified [%]", "cut, time for a pose [ms]"),
    )
    for run in runs(experiment=COSTS):
        names = ("uncut_percent", "cut_percent", "certified_sample_percent")
        shares = (f"{run[name]:.1f}" for name in names)
        table.add_row(run["robot"], *shares, f"{1e3 * run['seconds']['cut']:.3g}")
    return table


STUDY = Study(
    name="stability-bounds",
    title="Stability workspaces sampled, searched, simulated and proven in three ways, with costs",
    source="this project; robots, bounds and samples of the servoing thesis, 3.3",
    cases=cases,
    measure=measure,
    reduce=reduce,
    chunk=CHUNK,
    unit="poses",
    parameters=parameters,
    assumptions=ASSUMPTIONS,
    checks=CHECKS,
    tables=[shares_table, costs_table, cut_table],
    figures=FIGURES,
)
