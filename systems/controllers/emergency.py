"""What a robot does when a cable has broken: section `emergency` of a scenario, and its block.

* stop: the brakes of all winches close, `delay` after it is known;
* redistribute: the controller of motor torques asks the cables that are left for the wrench, at
  once, and the winch of the broken one stands still. The platform is to stay where it is, or to go
  on where the servo wants it;
* brake: the same, but only motion is to end, with least kinetic energy, wherever that is;
* retreat: the same, and the platform goes to the nearest pose that the cables left hold;
* descend: the same, and it goes straight down until its lowest anchor point is near the ground.

All but stop need `winches.mode` torque.

It is known by being told, as by a switch on the drum, or found by a `BreakDetector`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.break_detection import BreakRule, residual_noise
from cdpr_drake.geometry.poses import pose_from_row, pose_row, rotation_vector
from cdpr_drake.schema.declarations import FASTEST, In, OneOf, settings

STOP, REDISTRIBUTE, BRAKE, RETREAT, DESCEND = REACTIONS = (
    "stop", "redistribute", "brake", "retreat", "descend",
)  # fmt: skip
HOLD, CONTINUE = "hold", "continue"
TOLD, FOUND = "told", "found"

ACCEPTED = 1e-3
"""False alarms that a threshold accepts in `HOURS` hours of runs."""

HOURS = 1.0


@settings
class WatchSettings:
    """When other failures than broken cables are told; nothing is done about them.

    A reading of an encoder is up to a period old: by default `lag` covers 0.5 m/s at 512 Hz.
    """

    torque: Annotated[
        float | None,
        In("N m", gt=0.0),
        "Torque of a motor that asked torque, tension, inertia and friction do not "
        "explain; null: static friction, the tension sensor's constant error, and noise.",
    ] = None
    bandwidth: Annotated[
        float,
        In("Hz", gt=0.0),
        "At which this torque is smoothed; below a sixth of `emergency.rate`.",
    ] = 10.0
    lag: Annotated[
        float, In("m", gt=0.0), "By how much a measured length may lag behind the drive's speed."
    ] = 0.001
    leak: Annotated[float, In("s", gt=0.0), "Time in which such differences are forgotten."] = 1.0
    in_a_row: Annotated[int, In(ge=1), "Samples in a row of torque and lag that make an alarm."] = 5
    dark: Annotated[float, In("s", gt=0.0), "Without a sight of the target."] = 0.12
    late: Annotated[float, In("s", gt=0.0), "With the very same sight of it."] = 0.12


@settings
class EmergencySettings:
    """What is done when a cable has broken, and how that is known."""

    reaction: Annotated[str, OneOf(REACTIONS), "What is done."]
    motion: Annotated[
        str,
        OneOf((HOLD, CONTINUE)),
        "What redistribution is to do with the platform: hold it where it is, or continue.",
    ] = HOLD
    speed: Annotated[
        float,
        In("m/s", gt=0.0),
        "Largest speed of a retreat, of which turning counts with the anchor points' "
        "distance, and that of a descent.",
    ] = 0.1
    least_tension: Annotated[
        float, In("N", ge=0.0), "Smallest tension of the cables left at the pose of a retreat."
    ] = 0.5
    ground_distance: Annotated[
        float,
        In("m", ge=0.0),
        "Height of the lowest anchor point over the frame's lower end at which a descent ends.",
    ] = 0.02
    known: Annotated[
        str,
        OneOf((TOLD, FOUND)),
        "How it is known: told when it happens, or found from lengths and tensions.",
    ] = TOLD
    delay: Annotated[
        float,
        In("s", ge=0.0),
        "From when it is known until the brakes have closed, or the others are asked.",
    ] = 0.0
    rate: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "How often it is looked at."] = 500.0
    pose_noise: Annotated[
        float,
        In("m", ge=0.0),
        "Standard deviation of the lengths that follow from the believed pose and the sensors.",
    ] = 0.0002
    pose_accuracy: Annotated[
        float,
        In("m", ge=0.0),
        "By how much the error of the believed pose, at an anchor point, may change while"
        " a cable does not pull.",
    ] = 0.003
    exit_accuracy: Annotated[
        float, In("m", ge=0.0), "Bound of the errors of believed exit points."
    ] = 0.003
    anchor_accuracy: Annotated[
        float, In("m", ge=0.0), "Bound of the errors of believed anchor points."
    ] = 0.001
    slack_below: Annotated[
        float | None,
        In("N", ge=0.0),
        "Measured tension up to which a cable may be broken: what its sensor may read "
        "without one; null: by the sensor's accuracy and noise.",
    ] = None
    in_a_row: Annotated[int, In(ge=1), "Samples in a row that make an alarm."] = 3
    watch: Annotated[
        WatchSettings | None,
        "Watches winches, sensors and camera, too, and logs alarms; null: broken cables "
        "alone. With winches.mode torque.",
    ] = None

    def samples(self) -> float:
        """Looks in `HOURS`."""
        return 3600.0 * HOURS * self.rate

    def rule(self, cables: int) -> BreakRule:
        """When it is found, with so many cables: `ACCEPTED` false alarms in `HOURS`."""
        noise = residual_noise(
            self.pose_noise, samples=self.samples(), cables=cables, false_alarms=ACCEPTED
        )
        points = self.exit_accuracy + self.anchor_accuracy
        return BreakRule(noise, points, self.pose_accuracy, self.in_a_row)


APPROACH = 2.0
"""Rate at which a retreat's distance fades where its speed does not bound it [1/s]."""


@dataclass(frozen=True)
class WaysOut:
    """What a reaction that moves the platform knows of it.

    Attributes:
        held: Gives the nearest pose that the cables left hold, from the believed one and flags of
            those that are broken, shape (m,).
        anchors: Anchor points in P, shape (3, m) [m].
        ground: Height where the ground is [m].
    """

    held: Callable[[RigidTransform, Array], RigidTransform]
    anchors: Array
    ground: float

    @property
    def size(self) -> float:
        """Root mean square of the anchor points' distances from Po [m]."""
        return float(np.sqrt(np.mean(np.sum(self.anchors**2, axis=0))))


def retreat_twist(X_WP: RigidTransform, goal: RigidTransform, speed: float, size: float) -> Array:
    """Twist (w, v) of P in P toward a pose, shape (6,) [rad/s, m/s].

    Args:
        X_WP: Where it is.
        goal: Where it is to go.
        speed: The largest, of |v| and `size` |w| together [m/s].
        size: Length that makes turns comparable [m].
    """
    off = X_WP.inverse() @ goal
    twist = APPROACH * np.concatenate([rotation_vector(off.rotation()), off.translation()])
    fast = float(np.hypot(size * np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:])))
    return np.asarray(twist * min(1.0, speed / fast) if fast > 0.0 else twist)


def descent_twist(
    X_WP: RigidTransform, anchors: Array, ground: float, rule: EmergencySettings
) -> Array:
    """Twist (w, v) of P in P straight down, zero near the ground, shape (6,) [rad/s, m/s].

    Args:
        X_WP: Where it is.
        anchors: Anchor points in P, shape (3, m) [m].
        ground: Height of the ground [m].
        rule: Speed, and where it ends.
    """
    over = float(np.min((X_WP @ anchors)[2])) - ground - rule.ground_distance
    down = -min(rule.speed, max(APPROACH * over, 0.0))
    v = X_WP.rotation().matrix().T @ np.array([0.0, 0.0, down])
    return np.concatenate([np.zeros(3), v])


class EmergencyReaction(LeafSystem):
    """From cables that are known to be broken to brakes and to what the controller is told.

    ============ ============== ===== =======================================================
    port         type           unit  meaning
    ============ ============== ===== =======================================================
    found_broken vector(m)      -     in, not 0 for each cable that is known to be broken
    X_WP         RigidTransform m     in, believed pose; may stay open, but for retreat, descend
    jammed       vector(m)      -     out, 1 for each winch that is to stand still
    left_out     vector(m)      -     out, 1 for each cable that is not to be asked any more
    halted       vector(1)      -     out, 1 while the servo's wish does not count
    braking      vector(1)      -     out, 1 while motion is to end, wherever that is
    halted_twist vector(6)      rad/s out, twist (w, v) of P in P that is wanted while halted
                                m/s
    goal         vector(7)      -, m  out, where a retreat goes, as `pose_row`; NaN before
    ============ ============== ===== =======================================================

    Looks at its inputs at a rate. State: when each cable was known to be broken, and the outputs.
    Where a detector takes back what it told, the cable is asked again; brakes that closed stay so.
    The goal of a retreat is searched for once for each cable that breaks, when it acts.
    """

    def __init__(
        self, settings: EmergencySettings, cables: int, ways: WaysOut | None = None
    ) -> None:
        """With settings that are checked, and m cables, each on a winch of its own; `ways` for
        reactions that move the platform."""
        super().__init__()
        self._settings, m = settings, cables
        self._m, self._ways = m, ways
        self._found = self.DeclareVectorInputPort("found_broken", m)
        self._X_WP = self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        parts = (
            ("known", np.full(m, np.inf)), ("jammed", np.zeros(m)), ("left_out", np.zeros(m)),
            ("halted", np.zeros(1)), ("braking", np.zeros(1)), ("halted_twist", np.zeros(6)),
            ("goal", np.full(7, np.nan)),
        )  # fmt: skip
        state = self.DeclareDiscreteState(np.concatenate([start for _, start in parts]))
        needs, self._places, at = {self.discrete_state_ticket(state)}, {}, 0
        for name, start in parts:
            self._places[name] = slice(at, at + len(start))
            at += len(start)
        for name, start in parts[1:]:
            part = self._places[name]

            def write(context: Context, output: BasicVector, part: slice = part) -> None:
                output.SetFromVector(context.get_discrete_state_vector().value()[part])

            self.DeclareVectorOutputPort(name, len(start), write, needs)
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / settings.rate, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        m, time, rule = self._m, context.get_time(), self._settings
        before = context.get_discrete_state_vector().value()
        known = before[self._places["known"]]
        told, back = self._found.Eval(context) != 0.0, known if rule.reaction == STOP else np.inf
        known = np.where(told, np.minimum(known, time), back)
        acts = (known + rule.delay <= time * (1.0 + 1e-12)).astype(float)
        acting = float(np.max(acts))
        stops = np.full(m, acting) if rule.reaction == STOP else acts
        halts, brakes = acting * float(rule.motion == HOLD), acting * float(rule.reaction == BRAKE)
        twist, goal = np.zeros(6), before[self._places["goal"]]
        if acting and rule.reaction in (RETREAT, DESCEND):
            assert self._ways is not None
            X_WP = self._X_WP.Eval(context)
            if rule.reaction == DESCEND:
                twist = descent_twist(X_WP, self._ways.anchors, self._ways.ground, rule)
            else:
                if not np.array_equal(acts, before[self._places["left_out"]]):
                    goal = pose_row(self._ways.held(X_WP, acts))
                twist = retreat_twist(X_WP, pose_from_row(goal), rule.speed, self._ways.size)
        state.set_value(np.concatenate([known, stops, acts, [halts], [brakes], twist, goal]))
