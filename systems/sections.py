"""Sections of scenarios that hang on by a row: the core calls their hooks, and knows none by name.

A section is a folder of `cdpr_drake.sections`, or of another package, with a class of settings
that derives from `Section`. `SECTIONS` says where in a scenario each stands. Another package adds
its own by an entry point of the group `cdpr_drake.sections`, with a name such as
`visual_servo.my_section`.
"""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import import_module
from importlib.metadata import entry_points
from typing import Annotated, Any, ClassVar

from cdpr_drake.schema.declarations import Refusal, Scope, filled

SECTIONS = {
    "camera.pan_tilt": "cdpr_drake.sections.pan_tilt.section:CameraPanTilt",
    "sensors.pan_tilt": "cdpr_drake.sections.perception.section:PanTiltSettings",
    "sensors.range_sensors": "cdpr_drake.sections.perception.section:RangeSettings",
    "sensors.depth": "cdpr_drake.sections.perception.section:DepthSettings",
    "sensors.odometry": "cdpr_drake.sections.perception.section:OdometrySettings",
    "visual_servo.wrench_estimation": (
        "cdpr_drake.sections.wrench_estimation.section:WrenchEstimation"
    ),
    "visual_servo.adaptation": "cdpr_drake.sections.adaptation.section:Adaptation",
    "visual_servo.emergency": "cdpr_drake.sections.emergency.section:EmergencySettings",
    "visual_servo.stability": "cdpr_drake.sections.stability.section:StabilitySettings",
}
"""Module and class of each section, by the place of its key in scenarios; at a place, in the order
in which they add their blocks."""

GROUP = "cdpr_drake.sections"
"""Entry points of other packages' sections."""

_LOG = logging.getLogger(__name__)


class Section:
    """A section of a scenario: settings, which add blocks, columns of the log, numbers and figures.

    A subclass is made a class of settings by `schema.declarations.settings`. It overrides the hooks
    that it needs.

    Attributes:
        words: What the key of a scenario means.
        columns: By the names of the quantities that it logs: what their numbers are called in
            `log.csv`, each name ending in its unit; or the unit alone, of a number for each cable.
        many: True if the key has a list of such sections, each of which adds its own.
        needs_rendering: True if its blocks draw images, for which EGL is needed.
        report: Module and name of the `Subject`s of a run, as "package.module:NAME"; empty: none.
    """

    words: ClassVar[str]
    columns: ClassVar[Mapping[str, Sequence[str] | str]] = {}
    many: ClassVar[bool] = False
    needs_rendering: ClassVar[bool] = False
    report: ClassVar[str] = ""

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """What its settings cannot be together, or with robot and scenario; see `Scope`."""
        return iter(())

    def make_servo(self, model: Any, settings: Any) -> Any:
        """A servo in the place of the law alone.

        Args:
            model: What the servo is about, a `ServoModel`.
            settings: The scenario, or the `VisualServoSettings` of somebody's own diagram.

        Returns:
            A `FeatureServo`; None: the law alone, or what another section makes.
        """
        return None

    def add_to(self, builder: Any, blocks: Any, settings: Any) -> Mapping[str, Any]:
        """Adds its blocks to a visual servo.

        Args:
            builder: The DiagramBuilder that has the servo.
            blocks: The servo's `VisualServoBlocks`.
            settings: The scenario, or the `VisualServoSettings` of somebody's own diagram.

        Returns:
            Output ports that a run logs, by the names of the quantities.
        """
        return {}

    def log_columns(self) -> Mapping[str, Sequence[str] | str]:
        """`columns`, or others by these settings, which a run asks for."""
        return self.columns

    def sampling_rate(self) -> float | None:
        """How often it reads, by its field `rate` [Hz], at most once an integration step; None: it
        does not say."""
        return None

    def at_end(self, built: Any, context: Any) -> Mapping[str, Any]:
        """What only the diagram knows at the end of a run.

        Args:
            built: The `VisualServo`.
            context: The diagram's context.

        Returns:
            What `Run.at_end` has for the section's report, by names.
        """
        return {}


def sections_of(settings: Any) -> Iterator[tuple[str, Section]]:
    """The sections that settings have, in the order of their fields, each with its key."""
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        items = {field.name: value}
        if isinstance(value, list):
            items = {f"{field.name}[{k}]": item for k, item in enumerate(value)}
        for key, item in items.items():
            if isinstance(item, Section):
                yield key, item
            elif dataclasses.is_dataclass(item):
                for inside, section in sections_of(item):
                    yield f"{key}.{inside}", section


def with_sections(place: str) -> Callable[[type], type]:
    """Gives a class, before it is made settings, a field for each section of a place."""

    def extended(kind: type) -> type:
        for key, section in sections_at(place).items():
            if hasattr(kind, key) or key in kind.__annotations__:
                _LOG.warning("section %s.%s: left out: the key is taken", place, key)
                continue
            kind.__annotations__[key] = (
                Annotated[list[section], section.words]  # type: ignore[valid-type]
                if section.many
                else Annotated[section | None, f"{section.words}; null: none."]
            )
            setattr(kind, key, filled(list) if section.many else None)
        return kind

    return extended


def sections_at(place: str) -> dict[str, type[Section]]:
    """Classes of the sections of a place, by their keys.

    Another package's section that cannot be imported is left out, with a warning.
    """
    classes = {}
    foreign = {point.name: point.value for point in entry_points(group=GROUP)}
    for name, target in {**foreign, **SECTIONS}.items():
        where, _, key = name.rpartition(".")
        if where != place:
            continue
        try:
            section = load_object(target)
        except Exception as problem:
            if name in SECTIONS:
                raise
            _LOG.warning("entry point %s = %s: left out: %s", name, target, problem)
            continue
        classes[key] = section
    return classes


def load_object(target: str) -> Any:
    """What stands at "package.module:name"."""
    module, _, name = target.partition(":")
    return getattr(import_module(module), name)
