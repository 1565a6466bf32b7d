"""Sections of scenarios that hang on by a row: the core calls their hooks, and knows none by name.

A section is a folder of `cdpr_drake.sections`, or of another package, with a class of settings
that derives from `Section`. `SECTIONS` says where in a scenario each stands. Another package adds
its own by an entry point of the group `cdpr_drake.sections`, with a name such as
`visual_servo.my_section`.
"""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib import import_module
from importlib.metadata import entry_points
from typing import Annotated, Any, ClassVar

from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import Adder

from cdpr_drake.models.robot_schema import Robot
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
    "visual_servo.pose_plan": "cdpr_drake.sections.pose_plan.section:PosePlanSettings",
    "robot_scenario.disturbances": "cdpr_drake.sections.disturbances.section:DisturbanceSettings",
    "visual_servo.remote": "cdpr_drake.sections.remote.section:RemoteSettings",
    "tension_control.remote": "cdpr_drake.sections.remote.section:RemoteSettings",
    "tension_control.force_control": "cdpr_drake.sections.force_control.section:ForceControl",
    "tension_control.predictive": "cdpr_drake.sections.predictive.section:PredictiveSettings",
}
"""Module and class of each section, by the place of its key in scenarios.

Places are `visual_servo` and, within it, `camera` and `sensors`; `tension_control`; and
`robot_scenario`, every kind but that of mechanisms. At a place sections stand in the order in which
they add their blocks.
"""

GROUP = "cdpr_drake.sections"
"""Entry points of other packages' sections."""

_LOG = logging.getLogger(__name__)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Platform:
    """A platform in a builder, which sections may push.

    Attributes:
        robot: The robot.
        X_WP: Pose of the platform, abstract RigidTransform [m].
        state: Positions and velocities of its joint, as `CableForces` takes them: for one that
            moves freely quaternion and place of Po, then angular velocity and velocity of Po in W,
            shape (13,) [m, rad/s, m/s].
        seed: Of the scenario.
        prefix: What the names of blocks begin with.
    """

    robot: Robot
    X_WP: OutputPort
    state: OutputPort
    seed: int
    prefix: str = ""


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
        by_hand: By what can be done by hand to a run that goes on, see `do`: the section's least
            content, as YAML, which lets it be done and changes nothing. Of `robot_scenario` only.
        outside: True if a process outside closes the loop. The block in whose place it stands
            has an attribute `outside`, its place, which a run hands to `Follow.connect`.
    """

    words: ClassVar[str]
    columns: ClassVar[Mapping[str, Sequence[str] | str]] = {}
    many: ClassVar[bool] = False
    needs_rendering: ClassVar[bool] = False
    report: ClassVar[str] = ""
    by_hand: ClassVar[Mapping[str, str]] = {}
    outside: ClassVar[bool] = False

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

    def needs_plant(self, scenario: Any) -> bool:
        """Whether the engine plant alone can run a scenario that has it."""
        return False

    def tension_blocks(self, settings: Any, robot: Any) -> Mapping[str, Any]:
        """Makers of blocks of dynamic control in the place of the usual ones.

        Args:
            settings: The `TensionControlSettings` with the makers so far, and what is believed.
            robot: The robot.

        Returns:
            By the fields `controller` and `distributor` of these settings, which say what makers
            take and what a block may offer.
        """
        return {}

    def tension_loop(self, control: Any) -> Callable[[Any, float], Any] | None:
        """A loop that steps dynamic control in the place of its diagram.

        Args:
            control: The `TensionControl` with the blocks that the section has made.

        Returns:
            Makes the loop of the control and the rate of its log [Hz]: `TensionRows` with a `name`
            for the summary, `time`, `advance_to`, `pose` and `errors`. None: a diagram.
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

    def push(self, builder: DiagramBuilder, platform: Platform) -> OutputPort | None:
        """Adds what pushes the platform, in a scenario of any kind but a mechanism's.

        In a visual servo it is called after `add_to` of all sections, so that a block which
        `add_to` has added, and whose outputs are logged, may push.

        The engine compiled takes a wrench that follows the platform only from a state that its
        block samples; by the plant it may follow pose and state at once.

        Args:
            builder: The DiagramBuilder that has the robot.
            platform: The platform.

        Returns:
            Moment about Po and force on the platform in W, shape (6,) [N m, N], which is added to
            those of other sections and logged as `applied_wrench`; None: nothing pushes.
        """
        return None

    def do(self, request: Mapping[str, Any], now: float) -> dict[str, Any]:
        """Does by hand what a request asks for: enters it into these settings, which the blocks of
        the running diagram read, so that the scenario in the results gives the same run again.

        Args:
            request: `what`, a key of `by_hand`, and what belongs to it.
            now: The simulated time [s].

        Returns:
            Time `t` [s] at which it was asked for, and `words`.

        Raises:
            ScenarioError: It cannot be done; one line.
        """
        raise NotImplementedError


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


def add_pushes(
    builder: DiagramBuilder, sections: Iterable[Section], platform: Platform
) -> OutputPort | None:
    """Adds what sections push a platform with.

    Returns:
        The sum of their wrenches, shape (6,) [N m, N]; None: nothing pushes.
    """
    pushed = (section.push(builder, platform) for section in sections)
    wrenches = [wrench for wrench in pushed if wrench is not None]
    if len(wrenches) < 2:
        return wrenches[0] if wrenches else None
    total = builder.AddNamedSystem(platform.prefix + "pushes", Adder(len(wrenches), 6))
    for index, wrench in enumerate(wrenches):
        builder.Connect(wrench, total.get_input_port(index))
    return total.get_output_port()


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

    One that cannot be imported is left out, with a warning; a fault in one of this package raises.
    """
    classes, targets = {}, dict(SECTIONS)
    for point in entry_points(group=GROUP):
        if targets.setdefault(point.name, point.value) != point.value:
            _LOG.warning("section %s = %s: left out: the key is taken", point.name, point.value)
    for name, target in targets.items():
        where, _, key = name.rpartition(".")
        if where != place:
            continue
        try:
            section = load_object(target)
        except Exception as problem:
            if name in SECTIONS and not isinstance(problem, ModuleNotFoundError):
                raise
            _LOG.warning("section %s = %s: left out: %s", name, target, problem)
            continue
        classes[key] = section
    return classes


def load_object(target: str) -> Any:
    """What stands at "package.module:name"."""
    module, _, name = target.partition(":")
    return getattr(import_module(module), name)
