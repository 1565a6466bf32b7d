"""Studies that run configurations of one scenario, and judge what a thesis states of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.studies.framework.case_definition import Plan
from cdpr_drake.analyses.studies.framework.case_figures import case_figures
from cdpr_drake.analyses.studies.framework.case_run import measure_run
from cdpr_drake.analyses.studies.framework.case_tables import case_tables, configuration_numbers
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import Check, Finding
from cdpr_drake.analyses.studies.framework.study import Form, Study
from cdpr_drake.systems.cameras.camera_settings import PROJECTED

REPETITIONS, QUICK_REPETITIONS = 5, 1
"""Runs of a configuration with projected images, in the full form and in the quick one."""


def configuration_study(
    plan: Plan,
    *,
    source: str,
    repetitions: int = REPETITIONS,
    summaries: Sequence[Callable[[Runs], Table]] = (),
    drawings: Mapping[str, Callable[[Runs], Figure]] | None = None,
    assumptions: Sequence[str] = (),
    checks: Sequence[Check] = (),
) -> Study:
    """A study whose cases are configurations of a scenario.

    Key columns are configuration, group and camera. A configuration with rendered images is a case
    of its own, which is run once. Checks, figures and summaries see runs with projected images.

    Args:
        plan: Its configurations; the study's `cases`.
        source: Where it stands in the thesis.
        repetitions: Runs of each configuration, with seeds 0, 1, ...
        summaries: What puts runs into a table of its own.
        drawings: What draws figures of the study's own, by name.
        assumptions: What the thesis leaves open, and what was chosen.
        checks: What the thesis states.
    """
    figures = case_figures(plan) | dict(drawings or {})
    return Study(
        name=plan.name,
        title=plan.title,
        source=source,
        cases=plan,
        measure=measure_run,
        seeds=(repetitions, QUICK_REPETITIONS),
        checks=[replace(check, find=partial(_found, check.find)) for check in checks],
        stated="What the servoing thesis states",
        tables=[partial(case_tables, plan), *(partial(_projected, one) for one in summaries)],
        figures={file: partial(_projected, draw) for file, draw in figures.items()},
        assumptions=assumptions,
        parameters=partial(_parameters, plan),
        numbers=partial(_numbers, plan),
    )


def _found(find: Callable[[Runs], Finding], runs: Runs) -> Finding:
    return find(runs(camera=PROJECTED))


def _projected(make: Callable[[Runs], Any], runs: Runs) -> Any:
    """What is made of the runs with projected images; MissingRuns where there are none."""
    return make(runs(camera=PROJECTED))


def _parameters(plan: Plan, form: Form) -> dict[str, Any]:
    return {"scenario": plan.scenario, "changes": list(plan.changes), "stability": plan.stability}


def _numbers(plan: Plan, runs: Runs) -> dict[str, Any]:
    """Accuracy and repeatability of every configuration."""
    some = runs(camera=PROJECTED)
    return {
        c.name: configuration_numbers(some, c.name)
        for c in plan.configurations
        if some.has(configuration=c.name)
    }
