"""What a case study is: configurations of one scenario, with what was published about them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import Statement
from cdpr_drake.analyses.studies.framework.cable_figures import QUANTITIES
from cdpr_drake.analyses.studies.framework.case_layouts import Layout
from cdpr_drake.analyses.studies.framework.case_run import (
    METRICS,
    CaseJob,
    CaseRuns,
    Metric,
    OwnMetric,
)

QUICK_REPETITIONS = 1
"""Repetitions of a configuration in the quick form."""

PROJECTED = "camera.kind=projected"
RENDERED = "camera.kind=rendered"

PULLEYS = "cables.pulleys=true"
"""The simulated robot has the pulleys of the prototype; the controller knows nothing of them."""

EVERY_GROUP = (
    "image_paths", "camera_paths", "pose_estimates", "errors", "cable_velocities", "deviations",
    "estimates",
)  # fmt: skip
"""Figures of the runs of every experiment, by name."""


def group_suffix(group: str) -> str:
    """What the names of an experiment's figures end with; nothing for one without a name."""
    return f"_{group.lower().replace(' ', '_')}" if group else ""


@dataclass(frozen=True)
class Configuration:
    """One configuration of a case study.

    Attributes:
        name: Key in the results, once in a study.
        label: Words for legends and tables.
        changes: Items "key.subkey=value" that change the study's scenario.
        group: Experiment that it belongs to; each has its own tables and figures.
        scenario: Scenario to change; None: the study's.
        published: By metric, see `METRICS`, what the thesis prints, in its words.
        repetitions: Runs of it in the full form; None: as many as of the others.
        why: Why its numbers may differ from the published ones.
    """

    name: str
    label: str
    changes: tuple[str, ...] = ()
    group: str = ""
    scenario: str | None = None
    published: Mapping[str, str] = field(default_factory=dict)
    repetitions: int | None = None
    why: str = ""


@dataclass(frozen=True, kw_only=True)
class PublishedNumber:
    """A printed number of a configuration, and where a study's results have its own.

    Attributes:
        group: Experiment of the configuration; may be empty.
        configuration: Its name in the results.
        label: Words for it.
        metric: Name of the metric, or "outcome".
        heading: Words for the metric, with its unit.
        factor: From SI units to those that are printed.
        format: Of the number in those.
        printed: What is printed, in its words.
        why: Why ours may differ; may be empty.
    """

    group: str
    configuration: str
    label: str
    metric: str
    heading: str
    factor: float
    format: str
    printed: str
    why: str = ""


@dataclass(frozen=True, kw_only=True)
class CaseStudy:
    """A case study.

    Attributes:
        name: Its name for `cdpr study`.
        title: What it shows, in one line.
        source: Where it stands in the thesis.
        scenario: Scenario that the configurations change.
        changes: Changes that all configurations share.
        configurations: The configurations, in the order of the thesis.
        repetitions: Runs of each, with seeds 0, 1, ...
        rendered: Names of configurations that also run once with rendered images.
        quick: Names of configurations of the quick form, once each; all, if there are none.
        assumptions: What the thesis leaves open, and what was chosen.
        judges: Functions that judge a statement of the thesis; KeyError where runs are missing.
        own: Metrics of this study alone, by name.
        summaries: Functions that put runs into a table of their own; KeyError as of `judges`.
        drawings: What draws figures of the study's own, by name; KeyError as of `judges`.
        layouts: Published figures that are drawn in their own layout, by the name of the file.
        stability: Tension from which a cable counts in the stability criterion along the run [N];
            None: the traces do not have it.
    """

    name: str
    title: str
    source: str
    scenario: str
    configurations: tuple[Configuration, ...]
    changes: tuple[str, ...] = ()
    repetitions: int = 5
    rendered: tuple[str, ...] = ()
    quick: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    judges: Sequence[Callable[[CaseRuns], Statement]] = ()
    own: Mapping[str, OwnMetric] = field(default_factory=dict)
    summaries: Sequence[Callable[[CaseRuns], Table]] = ()
    drawings: Mapping[str, Callable[[CaseRuns], Figure]] = field(default_factory=dict)
    layouts: Mapping[str, Layout] = field(default_factory=dict)
    stability: float | None = None

    def jobs(self, quick: bool, seeds: int | None = None) -> list[CaseJob]:
        """The runs of this study: rendered ones first, then every configuration repeated, so often
        as `seeds` says, or the study itself."""
        some = self.quick if quick and self.quick else [c.name for c in self.configurations]
        chosen = [c for c in self.configurations if c.name in some]
        jobs = []
        if not quick:
            jobs += [self._job(c, 0, RENDERED) for c in chosen if c.name in self.rendered]
        for c in chosen:
            usual = c.repetitions or self.repetitions
            repetitions = seeds or (QUICK_REPETITIONS if quick else usual)
            jobs += [self._job(c, seed, PROJECTED) for seed in range(repetitions)]
        return jobs

    def _job(self, configuration: Configuration, seed: int, camera: str) -> CaseJob:
        changes = (*self.changes, *configuration.changes, camera, f"seed={seed}")
        scenario = configuration.scenario or self.scenario
        rendered = camera == RENDERED
        return CaseJob(
            configuration.name, scenario, changes, seed, rendered, self.own, self.stability
        )

    def metrics(self) -> dict[str, Metric]:
        """What describes its runs, by name."""
        return {**METRICS, **self.own}

    def published(self) -> tuple[PublishedNumber, ...]:
        """The printed numbers of all configurations, in their order."""
        outcome, known = Metric("outcome", 1.0, "s"), self.metrics()
        return tuple(
            PublishedNumber(
                group=c.group,
                configuration=c.name,
                label=c.label,
                metric=name,
                heading=known.get(name, outcome).heading,
                factor=known.get(name, outcome).factor,
                format=known.get(name, outcome).format,
                printed=printed,
                why=c.why,
            )
            for c in self.configurations
            for name, printed in c.published.items()
        )

    def figures(self) -> tuple[str, ...]:
        """Names of all figures that it can write, without endings."""
        names = [*EVERY_GROUP, *((*QUANTITIES, "stability") if self.stability is not None else ())]
        drawn = [f"{name}{group_suffix(group)}" for group in self.groups() for name in names]
        return (*drawn, *self.layouts, *self.drawings)

    def groups(self) -> dict[str, list[Configuration]]:
        """Configurations by experiment, in their order."""
        found: dict[str, list[Configuration]] = {}
        for configuration in self.configurations:
            found.setdefault(configuration.group, []).append(configuration)
        return found
