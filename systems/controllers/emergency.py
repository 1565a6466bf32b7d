"""What a robot does when a cable has broken: section `emergency` of a scenario, and its block.

* stop: the brakes of all winches close, `delay` after it is known;
* redistribute: the controller of motor torques asks the cables that are left for the wrench, at
  once, and the winch of the broken one stands still; by `winches.mode` torque alone. The platform
  is to stay where it is, or to go on where the servo wants it.

It is known by being told, as by a switch on the drum, or found by a `BreakDetector`.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from cdpr_drake.estimation.failure_detection import AlarmRule, threshold
from cdpr_drake.schema.fields import FASTEST, number, optional_section, text, whole

STOP, REDISTRIBUTE = REACTIONS = ("stop", "redistribute")
HOLD, CONTINUE = "hold", "continue"
TOLD, FOUND = "told", "found"

ACCEPTED = 1e-3
"""False alarms that a threshold accepts in `HOURS` hours of runs."""

HOURS = 1.0


@dataclass(kw_only=True)
class WatchSettings:
    """When other failures than broken cables are told; nothing is done about them.

    Torque and lag have bounds that undisturbed runs of ACROBOT stay below; see study `detection`.
    """

    torque: float = number(
        "Torque of a motor that asked torque, tension, inertia and friction do not explain.",
        "N m",
        0.015,
        above=0.0,
    )
    bandwidth: float = number(
        "At which this torque is smoothed; below a sixth of `emergency.rate`.", "Hz", 10.0,
        above=0.0,
    )  # fmt: skip
    lag: float = number(
        "By how much a measured length may lag behind the drive's speed.", "m", 1e-3, above=0.0
    )
    leak: float = number("Time in which such differences are forgotten.", "s", 1.0, above=0.0)
    in_a_row: int = whole("Samples in a row of torque and lag that make an alarm.", 5, at_least=1)
    dark: float = number("Without a sight of the target.", "s", 0.12, above=0.0)
    late: float = number("With the very same sight of it.", "s", 0.12, above=0.0)


@dataclass(kw_only=True)
class EmergencySettings:
    """What is done when a cable has broken, and how that is known."""

    reaction: str = text("What is done.", choices=REACTIONS)
    motion: str = text(
        "What redistribution is to do with the platform: hold it where it is, or continue.",
        HOLD,
        choices=(HOLD, CONTINUE),
    )
    known: str = text(
        "How it is known: told when it happens, or found from lengths and tensions.",
        TOLD,
        choices=(TOLD, FOUND),
    )
    delay: float = number(
        "From when it is known until the brakes have closed, or the others are asked.", "s", 0.0,
        at_least=0.0,
    )  # fmt: skip
    rate: float = number("How often it is looked at.", "Hz", 500.0, above=0.0, at_most=FASTEST)
    pose_noise: float = number(
        "Standard deviation of the lengths that follow from the believed pose and the sensors.",
        "m",
        2e-4,
        at_least=0.0,
    )
    pose_bias: float = number("Bound of the slow errors of these lengths.", "m", 5e-3, at_least=0.0)
    slack_below: float = number(
        "Measured tension below which a cable may be broken: what its sensor may read without one.",
        "N",
        0.5,
        above=0.0,
    )
    in_a_row: int = whole("Samples in a row that make an alarm.", 3, at_least=1)
    watch: WatchSettings | None = optional_section(
        "Watches winches, sensors and camera, too, and logs alarms; null: broken cables alone. "
        "With winches.mode torque."
    )

    def rule(self, cables: int) -> AlarmRule:
        """When it is found, with so many cables: `ACCEPTED` false alarms in `HOURS`."""
        limit = threshold(
            self.pose_noise, bias=self.pose_bias, samples=3600.0 * HOURS * self.rate,
            residuals=cables, in_a_row=self.in_a_row, false_alarms=ACCEPTED,
        )  # fmt: skip
        return AlarmRule(limit, self.in_a_row)


class EmergencyReaction(LeafSystem):
    """From cables that are known to be broken to brakes and to what the controller is told.

    ============ ========= ==== ===========================================================
    port         type      unit meaning
    ============ ========= ==== ===========================================================
    found_broken vector(m) -    in, not 0 for each cable that is known to be broken
    jammed       vector(m) -    out, 1 for each winch that is to stand still
    left_out     vector(m) -    out, 1 for each cable that is not to be asked any more
    halted       vector(1) -    out, 1 while the platform is to stay where it is
    ============ ========= ==== ===========================================================

    Looks at its input at a rate. State: when each cable was known to be broken, and the outputs.
    """

    def __init__(self, settings: EmergencySettings, cables: int) -> None:
        """With settings that are checked, and m cables, each on a winch of its own."""
        super().__init__()
        self._settings, m = settings, cables
        self._m = m
        self._found = self.DeclareVectorInputPort("found_broken", m)
        state = self.DeclareDiscreteState(np.concatenate([np.full(m, np.inf), np.zeros(2 * m + 1)]))
        needs = {self.discrete_state_ticket(state)}
        for name, start, end in (
            ("jammed", m, 2 * m), ("left_out", 2 * m, 3 * m), ("halted", 3 * m, 3 * m + 1)
        ):  # fmt: skip
            part = slice(start, end)

            def write(context: Context, output: BasicVector, part: slice = part) -> None:
                output.SetFromVector(context.get_discrete_state_vector().value()[part])

            self.DeclareVectorOutputPort(name, end - start, write, needs)
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / settings.rate, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        m, time = self._m, context.get_time()
        known = context.get_discrete_state_vector().value()[:m]
        known = np.where(self._found.Eval(context) != 0.0, np.minimum(known, time), known)
        acts = (known + self._settings.delay <= time * (1.0 + 1e-12)).astype(float)
        stops = np.full(m, np.max(acts)) if self._settings.reaction == STOP else acts
        halts = np.max(acts) * float(self._settings.motion == HOLD)
        state.set_value(np.concatenate([known, stops, acts, [halts]]))
