"""What fails at a robot: section `failures` of a scenario, and its block.

Every failure begins at a time and lasts. See `FAILURES` for what there is:

* cable_breaks: the cable pulls nothing from then on, and what it had stored is gone with it;
* winch_jams: the drum stands still. An ideal winch stops at once, the drum of a motor within the
  settling time of its friction;
* power_lost: the motor has no torque; cable, friction and inertia turn it;
* brake_closes: as winch_jams, `delay` after it was asked to; that it may slip is left out;
* sensor_freezes: a sensor goes on to give what it read last, of one cable or of all;
* message_late: what a sensor reads comes `delay` later from then on, of one cable or of all; until
  the first of that comes, it gives what it read last.

A camera that goes dark is `camera.fault` of a scenario.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    EventStatus,
    LeafSystem,
)

from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import In, OneOf, Refusal, Scope, Text, filled, settings

BROKEN, JAMMED, POWERLESS = FAULTS = ("broken", "jammed", "powerless")
"""Inputs and outputs of a robot block with `failures`: 1 for each cable that is broken, for each
winch that stands still, for each motor without power; else 0."""

BREAKS, JAMS, POWER, BRAKE = "cable_breaks", "winch_jams", "power_lost", "brake_closes"
FREEZES, LATE = OF_SENSORS = "sensor_freezes", "message_late"

FAILURES: dict[str, str | None] = {
    BREAKS: BROKEN, JAMS: JAMMED, POWER: POWERLESS, BRAKE: JAMMED, FREEZES: None, LATE: None,
}  # fmt: skip
"""Kinds of failures, and the flag of the robot that each sets."""

NEEDS = {
    BREAKS: ("cable",), JAMS: ("winch",), POWER: ("winch",), BRAKE: ("winch",),
    FREEZES: ("sensor",), LATE: ("sensor", "delay"),
}  # fmt: skip
"""Fields that each kind needs."""

OPTIONAL = {BRAKE: ("delay",), FREEZES: ("cable",), LATE: ("cable",)}
"""Further fields that a kind may have."""

WORDS = {
    BREAKS: "breaks",
    JAMS: "jams",
    POWER: "loses power",
    BRAKE: "brake has closed",
    FREEZES: "sensor freezes",
    LATE: "messages are late",
}
"""The same as figures say it."""

_ONCE = 1e12
"""Period of an event that comes once [s]: longer than any run."""


@dataclass(frozen=True)
class Equipment:
    """What of a robot may fail: numbers of cables and winches, motors, and sensors by name."""

    cables: int
    winches: int
    motors: bool
    sensors: tuple[str, ...] = ()
    per_cable: tuple[str, ...] = ("tension", "encoder")

    @classmethod
    def of(cls, scenario: Any, robot: Robot) -> "Equipment":
        """That of a scenario's robot."""
        sensors = scenario.sensors.sampled() if hasattr(scenario, "sensors") else ()
        count = robot.winch_groups().count
        return cls(len(robot.cables), count, scenario.winches.has_motors(), tuple(sensors))

    def knows(self, name: str, found: int | str | float) -> bool:
        """Whether there is what a field of a failure says."""
        if name == "sensor":
            return found in self.sensors
        return name == "delay" or float(found) < self._count(name)

    def accepted(self, name: str) -> str:
        """What there is, in words."""
        if name == "sensor":
            return ", ".join(self.sensors) or "one of sensors.log that samples, of which is none"
        return "a number of seconds" if name == "delay" else f"0 to {self._count(name) - 1}"

    def _count(self, name: str) -> int:
        return self.cables if name == "cable" else self.winches


@settings
class Failure:
    """One thing that fails."""

    kind: Annotated[str, OneOf(FAILURES), "What fails."]
    time: Annotated[float, In("s", ge=0.0), "When."]
    cable: Annotated[int | None, In(ge=0), "Number of the cable that breaks, from 0."] = None
    winch: Annotated[
        int | None,
        In(ge=0),
        "Number of the winch that fails, from 0; each cable has its own, but where the "
        "robot's file puts several on one.",
    ] = None
    delay: Annotated[
        float | None,
        In("s", ge=0.0),
        "From the time until a brake has closed, null: at once; of messages that are late.",
    ] = None
    sensor: Annotated[
        Text | None, "Which sensor freezes or is late, as section sensors names it."
    ] = None

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """What is missing, belongs to another kind, or is not there."""
        has = Equipment.of(scope.whole, scope.robot)
        for name in ("cable", "winch", "sensor", "delay"):
            found, mine = getattr(self, name), name in NEEDS[self.kind]
            if found is None and mine:
                yield name, f"none with {self.kind}", has.accepted(name)
            elif found is not None and not mine and name not in OPTIONAL.get(self.kind, ()):
                yield name, f"{found} with {self.kind}", "null"
            elif found is not None and not has.knows(name, found):
                yield name, found, has.accepted(name)
        if self.kind == POWER and not has.motors:
            found = f"{self.kind} with ideal winches, which have no motors"
            yield "kind", found, f"{BREAKS}, {JAMS}, {BRAKE}, or winches.kind motor"
        if self.cable is not None and self.sensor not in (None, *has.per_cable):
            yield "cable", f"{self.cable} with {self.sensor}", "null"

    def words(self, robot: Robot) -> str:
        """What fails, in words: the cable, or the winch by the cables on it."""
        on = [
            cable.name
            for cable, winch in zip(robot.cables, robot.winch_groups().of_cable, strict=True)
            if winch == self.winch
        ]
        if self.kind in OF_SENSORS:
            of = "" if self.cable is None else f" of {robot.cables[self.cable].name}"
            return f"{self.sensor}{of}: {WORDS[self.kind]}"
        what = robot.cables[self.index].name if self.kind == BREAKS else "winch of " + ", ".join(on)
        return f"{what}: {WORDS[self.kind]}"

    @property
    def index(self) -> int:
        """Number of the cable or winch."""
        found = self.cable if self.kind == BREAKS else self.winch
        assert found is not None
        return found

    @property
    def begins(self) -> float:
        """When it acts [s]."""
        return self.time + (self.delay or 0.0 if self.kind == BRAKE else 0.0)


@settings
class FailureSettings:
    """What fails at a robot."""

    events: Annotated[list[Failure], "What fails, and when."] = filled(list)

    def flags(self, time: float, cables: int, winches: int) -> dict[str, Array]:
        """What has failed by a time [s], by the names of `FAULTS`."""
        out = {name: np.zeros(cables if name == BROKEN else winches) for name in FAULTS}
        for event in self.events:
            flag = FAILURES[event.kind]
            if flag is not None and event.begins <= time:
                out[flag][event.index] = 1.0
        return out

    def of_sensors(self) -> Iterator[Failure]:
        """Those of sensors."""
        return (event for event in self.events if event.kind in OF_SENSORS)


class Failures(LeafSystem):
    """What has failed by now, as flags.

    ========= ========= ==== ===================================================
    port      type      unit meaning
    ========= ========= ==== ===================================================
    broken    vector(m) -    in, may stay open: cables that are broken besides
    jammed    vector(k) -    in, may stay open: winches that stand still besides
    powerless vector(k) -    in, may stay open: motors without power besides
    broken    vector(m) -    out, 1 for each cable that is broken, else 0
    jammed    vector(k) -    out, 1 for each winch that stands still
    powerless vector(k) -    out, 1 for each motor without power
    ========= ========= ==== ===================================================

    State: the flags of what is in the settings. They change at the times that these say, where a
    simulator ends its steps. Without events it looks at each step, for what is added by hand.
    """

    def __init__(self, settings: FailureSettings, cables: int, winches: int) -> None:
        """With settings that are checked, m cables and k winches."""
        super().__init__()
        self._settings, self._counts = settings, (cables, winches)
        sizes = [cables, winches, winches]
        ends = np.cumsum([0, *sizes])
        state = self.DeclareDiscreteState(int(ends[-1]))
        for k, name in enumerate(FAULTS):
            more = self.DeclareVectorInputPort(name, sizes[k])
            part = slice(int(ends[k]), int(ends[k + 1]))

            def write(
                context: Context, output: BasicVector, more: object = more, part: slice = part
            ) -> None:
                flags = context.get_discrete_state_vector().value()[part]
                if more.HasValue(context):  # type: ignore[attr-defined]
                    flags = np.maximum(flags, more.Eval(context) != 0.0)  # type: ignore[attr-defined]
                output.SetFromVector(flags)

            needs = {self.discrete_state_ticket(state), more.ticket()}
            self.DeclareVectorOutputPort(name, sizes[k], write, needs)
        self.DeclareInitializationDiscreteUpdateEvent(self._update)
        for time in sorted({e.begins for e in settings.events if FAILURES[e.kind] is not None}):
            self.DeclarePeriodicDiscreteUpdateEvent(_ONCE, time, self._update)
        if not settings.events:
            self.DeclarePerStepDiscreteUpdateEvent(self._update_by_hand)

    def add(self, event: Failure) -> None:
        """Lets something fail at the next step, where the settings had no events at the start.

        The event stands in the settings then: a run with those from the start is the same run.
        """
        self._settings.events.append(event)

    def _update_by_hand(self, context: Context, state: DiscreteValues) -> EventStatus:
        if not self._settings.events:
            return EventStatus.DidNothing()
        self._update(context, state)
        return EventStatus.Succeeded()

    def _update(self, context: Context, state: DiscreteValues) -> None:
        flags = self._settings.flags(context.get_time(), *self._counts)
        state.set_value(np.concatenate([flags[name] for name in FAULTS]))
