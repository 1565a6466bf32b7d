"""Configurations of one scenario as cases of a study, with what was published about them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from cdpr_drake.analyses.studies.framework.case_layouts import Layout
from cdpr_drake.analyses.studies.framework.case_run import METRICS, Metric, OwnMetric, Recipe
from cdpr_drake.analyses.studies.framework.statement import check_cause
from cdpr_drake.analyses.studies.framework.study import Case, Form
from cdpr_drake.systems.cameras.camera_settings import PROJECTED, RENDERED

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
        cause: Of what kind that is, see `framework.statement`; empty: nobody knows.
        platform: Arrays of the section `platform` that replace those of the robot's file.

    Raises:
        ValueError: The cause is unknown.
    """

    name: str
    label: str
    changes: tuple[str, ...] = ()
    group: str = ""
    scenario: str | None = None
    published: Mapping[str, str] = field(default_factory=dict)
    repetitions: int | None = None
    why: str = ""
    cause: str = ""
    platform: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Checks the cause."""
        check_cause(self.cause)


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
        cause: Of what kind that is, see `framework.statement`; empty: nobody knows.
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
    cause: str = ""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Which configurations a study runs, and what is shown of them; called with a form of the
    study it gives their cases.

    Attributes:
        title: What the study shows, in one line.
        name: Its name.
        scenario: Scenario that the configurations change.
        changes: Changes that all configurations share.
        configurations: The configurations, in the order of the thesis.
        rendered: Names of configurations that also run once with rendered images.
        quick: Names of configurations of the quick form; all, if there are none.
        own: Metrics of this study alone, by name.
        layouts: Published figures that are drawn in their own layout, by the name of the file.
        laps_s: Of experiments behind an object that runs in laps, the time of a lap [s]. Curves
            over all of them would be one dark band: figures show the first two, or the largest
            value of each.
        stability: Tension from which a cable counts in the stability criterion along the run [N];
            None: the traces do not have it.
        why: Why numbers of configurations may differ that say nothing themselves.
        cause: Of what kind that is, see `framework.statement`.

    Raises:
        ValueError: The cause is unknown.
    """

    title: str
    name: str
    scenario: str
    configurations: tuple[Configuration, ...]
    changes: tuple[str, ...] = ()
    rendered: tuple[str, ...] = ()
    quick: tuple[str, ...] = ()
    own: Mapping[str, OwnMetric] = field(default_factory=dict)
    layouts: Mapping[str, Layout] = field(default_factory=dict)
    laps_s: Mapping[str, float] = field(default_factory=dict)
    stability: float | None = None
    why: str = ""
    cause: str = ""

    def __post_init__(self) -> None:
        """Checks the cause."""
        check_cause(self.cause)

    def __call__(self, form: Form) -> Iterator[Case]:
        """The cases: rendered ones first, which take longest and are not in the quick form."""
        some = self.quick if form.quick and self.quick else [c.name for c in self.configurations]
        chosen = [c for c in self.configurations if c.name in some]
        if not form.quick:
            yield from (self._case(c, RENDERED) for c in chosen if c.name in self.rendered)
        yield from (self._case(c, PROJECTED) for c in chosen)

    def _case(self, configuration: Configuration, camera: str) -> Case:
        rendered = camera == RENDERED
        return Case(
            name=f"{configuration.name}, {camera}" if rendered else configuration.name,
            keys={"configuration": configuration.name, "group": configuration.group,
                  "camera": camera},
            label=configuration.label,
            changes=(*self.changes, *configuration.changes, f"camera.kind={camera}"),
            data=Recipe(
                configuration.scenario or self.scenario, self.own, self.stability,
                configuration.platform,
            ),
            seeds=configuration.repetitions,
            most=1 if rendered else None,
            rendered=rendered,
            printed={} if rendered else configuration.published,
            why=configuration.why or self.why,
            cause=configuration.cause or self.cause,
        )  # fmt: skip

    def metrics(self) -> dict[str, Metric]:
        """What describes its runs, by name."""
        return {**METRICS, **self.own}

    def published(self) -> tuple[PublishedNumber, ...]:
        """The printed numbers of all configurations, in their order."""
        outcome, known = Metric("outcome", 1.0, "s"), self.metrics()
        return tuple(
            PublishedNumber(
                group=case.keys["group"],
                configuration=case.keys["configuration"],
                label=case.label,
                metric=name,
                heading=known.get(name, outcome).heading,
                factor=known.get(name, outcome).factor,
                format=known.get(name, outcome).format,
                printed=printed,
                why=case.why,
                cause=case.cause,
            )
            for case in self(Form())
            for name, printed in case.printed.items()
        )

    def groups(self) -> dict[str, list[Configuration]]:
        """Configurations by experiment, in their order."""
        found: dict[str, list[Configuration]] = {}
        for configuration in self.configurations:
            found.setdefault(configuration.group, []).append(configuration)
        return found
