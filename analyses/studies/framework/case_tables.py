"""Tables of configurations: what was published, beside what was found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.case_definition import Configuration, Plan
from cdpr_drake.analyses.studies.framework.case_run import Metric, outcomes
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.systems.cameras.camera_settings import PROJECTED, RENDERED

CAMERAS = {PROJECTED: "projected camera", RENDERED: "rendered images, one run each"}
"""What tables say of the camera."""


def case_tables(plan: Plan, runs: Runs) -> list[Table]:
    """Numbers of all configurations, the rendered runs, what was published."""
    tables, by_camera = [], dict(runs.by("camera"))
    for group, configurations in plan.groups().items():
        for camera, words in CAMERAS.items():
            found = by_camera.get(camera, Runs(()))
            some = [c for c in configurations if found.has(configuration=c.name)]
            if some:
                title = f"{plan.title}: {group}" if group else plan.title
                tables.append(_numbers(f"{title}; {words}", some, found, plan.metrics()))
                if camera == PROJECTED:
                    tables[-1].caption = "Means over the runs, which are in results.json."
    return tables + _published(plan, by_camera.get(PROJECTED, Runs(())))


def _published(plan: Plan, found: Runs) -> list[Table]:
    """What is printed of configurations beside what was found; none where nothing is."""
    some = [c for c in plan.configurations if c.published and found.has(configuration=c.name)]
    table = new_table(
        "Published | here (mean over the runs, +- half of the range)",
        ("configuration", "what"),
        ("published", "here"),
    )
    for c in some:
        for name, words in c.published.items():
            if name == "outcome":
                table.add_row(c.label, name, words, outcomes(found, c.name))
                continue
            metric, values = plan.metrics()[name], found(configuration=c.name)[name]
            table.add_row(c.label, metric.heading, words, _cell(values, metric, spread=True))
    return [table] if some else []


def _numbers(
    title: str, configurations: Sequence[Configuration], found: Runs, metrics: Mapping[str, Metric]
) -> Table:
    headings = [metric.heading for metric in metrics.values()]
    table = new_table(title, ("configuration", "outcome"), headings)
    for c in configurations:
        runs = found(configuration=c.name)
        cells = [_cell(runs[name], metric) for name, metric in metrics.items()]
        table.add_row(c.label, outcomes(found, c.name), *cells)
    return table


def _cell(values: np.ndarray, known: Metric, spread: bool = False) -> str:
    if not np.all(np.isfinite(values)):
        return "-"
    scaled = known.factor * values
    half = (scaled.max() - scaled.min()) / 2.0
    mean = format(scaled.mean(), known.format)
    return mean if len(values) == 1 or not spread else f"{mean} +- {format(half, known.format)}"


def configuration_numbers(found: Runs, configuration: str) -> dict[str, Any]:
    """Accuracy and repeatability of the platform's last position in the runs of a configuration.

    Returns:
        accuracy_m, distance of the mean position from the mean goal; repeatability_m, largest
        distance from the mean position.

    Raises:
        MissingRuns: There are none.

    Source: servoing thesis, figure 2.13.
    """
    runs = found(configuration=configuration)
    ends = np.array([run["camera_path"][-1] for run in runs])
    goal = np.array([run["camera_line"][-1] for run in runs]).mean(axis=0)
    middle = ends.mean(axis=0)
    return {
        "accuracy_m": float(np.linalg.norm(middle - goal)),
        "repeatability_m": float(np.max(np.linalg.norm(ends - middle, axis=1))),
    }
