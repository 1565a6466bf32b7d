"""Tables of case studies: what was published, beside what was found."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import (
    Statement,
    new_table,
    run_checks,
    statement_table,
)
from cdpr_drake.analyses.studies.framework.case_definition import CaseStudy, Configuration
from cdpr_drake.analyses.studies.framework.case_run import CaseRun, CaseRuns, Metric


def case_tables(
    case: CaseStudy, runs: Sequence[CaseRun], statements: Sequence[Statement]
) -> list[Table]:
    """Numbers of all configurations, the rendered runs, what was published, the study's own
    summaries, the statements."""
    found = CaseRuns(runs)
    tables = []
    for group, configurations in case.groups().items():
        for rendered in (False, True):
            some = [c for c in configurations if found.has(c.name, rendered)]
            if some:
                title = f"{case.title}: {group}" if group else case.title
                tables.append(_numbers(title, some, found, rendered, case.metrics()))
    published = [c for c in case.configurations if c.published and found.has(c.name)]
    if published:
        table = new_table(
            "Published | here (mean over the runs, +- half of the range)",
            ("configuration", "what"),
            ("published", "here"),
        )
        for c in published:
            for metric, words in c.published.items():
                known = case.metrics().get(metric)
                table.add_row(c.label, *_published_row(found, c.name, metric, words, known))
        tables.append(table)
    tables += run_checks(case.summaries, found)
    if statements:
        tables.append(statement_table("What the servoing thesis states", statements))
    return tables


def _published_row(
    found: CaseRuns, configuration: str, metric: str, words: str, known: Metric | None
) -> tuple[str, str, str]:
    if metric == "outcome":
        return "outcome", words, found.outcomes(configuration)
    assert known is not None
    return known.heading, words, _cell(found.values(configuration, metric), known, spread=True)


def _numbers(
    title: str,
    configurations: Sequence[Configuration],
    found: CaseRuns,
    rendered: bool,
    metrics: Mapping[str, Metric],
) -> Table:
    camera = "rendered images, one run each" if rendered else "projected camera"
    headings = [metric.heading for metric in metrics.values()]
    table = new_table(f"{title}; {camera}", ("configuration", "outcome"), headings)
    for c in configurations:
        runs = found.of(c.name, rendered)
        names = [run.outcome for run in runs]
        outcomes = ", ".join(f"{names.count(n)} {n}" for n in dict.fromkeys(names))
        cells = [
            _cell(np.array([_number(run, name) for run in runs]), metric)
            for name, metric in metrics.items()
        ]
        table.add_row(c.label, outcomes, *cells)
    if not rendered:
        table.caption = "Means over the runs; their ranges are in results.json."
    return table


def _number(run: CaseRun, metric: str) -> float:
    value = run.metrics[metric]
    return float("nan") if value is None else value


def _cell(values: np.ndarray, known: Metric, spread: bool = False) -> str:
    if not np.all(np.isfinite(values)):
        return "-"
    scaled = known.factor * values
    half = (scaled.max() - scaled.min()) / 2.0
    mean = format(scaled.mean(), known.format)
    return mean if len(values) == 1 or not spread else f"{mean} +- {format(half, known.format)}"


def configuration_numbers(
    found: CaseRuns, configuration: str, metrics: Iterable[str]
) -> dict[str, Any]:
    """Statistics over the projected runs of a configuration, SI units; empty where there are none.

    Returns:
        outcomes in words; by metric its mean, smallest and largest; accuracy and repeatability of
        the platform's last position: distance of the mean position from the mean goal, and largest
        distance from the mean position [m] (servoing thesis, figure 2.13).
    """
    try:
        runs = found.of(configuration)
    except KeyError:
        return {}
    numbers: dict[str, Any] = {"outcomes": found.outcomes(configuration), "runs": len(runs)}
    for metric in metrics:
        values = found.values(configuration, metric)
        numbers[metric] = {
            "mean": float(values.mean()),
            "min": float(values.min()),
            "max": float(values.max()),
        }
    ends = np.array([run.traces["camera_path"][-1] for run in runs])
    goal = np.array([run.traces["camera_line"][-1] for run in runs]).mean(axis=0)
    middle = ends.mean(axis=0)
    numbers["accuracy_m"] = float(np.linalg.norm(middle - goal))
    numbers["repeatability_m"] = float(np.max(np.linalg.norm(ends - middle, axis=1)))
    return numbers
