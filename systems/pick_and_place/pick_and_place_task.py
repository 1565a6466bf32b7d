"""The phases of picking a box up and setting it down, as a function of what is seen and felt.

A step gets the estimated pose of the platform, what the cameras measured, and the gripper's
readings; it says in which phase the task is, and where the platform shall go. Where box and goal
are is believed in the frame in which the platform's pose is estimated: what is seen corrects it,
and while nothing is seen it stays, so that the platform goes on by dead reckoning.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import exponential, logarithm, pose_error, pose_from_row, pose_row


class Phase(IntEnum):
    """Phases in their order; the names in lower case are those of scenarios and summaries."""

    APPROACH = 0
    DESCEND = 1
    GRASP = 2
    LIFT = 3
    CARRY = 4
    LOWER = 5
    RELEASE = 6
    RETREAT = 7
    DONE = 8
    FAILED = 9

    @property
    def word(self) -> str:
        """Its name in lower case."""
        return self.name.lower()


class Failure(IntEnum):
    """Why a task failed."""

    NONE = 0
    TAG_NOT_SEEN = 1
    NOT_GRASPED = 2
    DROPPED = 3
    TOO_LONG = 4


FAILURE_WORDS = {
    Failure.TAG_NOT_SEEN: "the tag that it needs was not seen for longer than handling.blind",
    Failure.NOT_GRASPED: "the box was out of the gripper's reach when it closed",
    Failure.DROPPED: "the gripper lost the box",
    Failure.TOO_LONG: "it took longer than handling.phase_limit",
}
"""What to say of a failure, after the name of its phase."""

LOOKS_AT_OBJECT = (Phase.APPROACH, Phase.DESCEND, Phase.LIFT)
LOOKS_AT_GOAL = (Phase.CARRY, Phase.LOWER)
NEEDS_TAG = (Phase.APPROACH, Phase.DESCEND, Phase.CARRY, Phase.LOWER)
CARRIES = (Phase.LIFT, Phase.CARRY, Phase.LOWER)
CLOSED = (Phase.GRASP, *CARRIES)
RESTS = (Phase.GRASP, Phase.RELEASE, Phase.DONE, Phase.FAILED)
PASSED = (Phase.APPROACH, Phase.LIFT, Phase.CARRY, Phase.RETREAT)
"""Phases that look at a tag, that cannot end without it, that hold the box, in which the gripper is
closed, in which the platform rests, and whose ends are points on the way."""

NOW = 1e-9
"""Times that differ by less are the same instant [s]."""

GAP = 5e-4
"""At which the tip stops above the box, so that it does not press on it [m]."""

PRESS = 1e-3
"""The box is lowered to so far below the goal, so that it stands before it is let go [m]."""

SUPPORTED = 0.5
"""Share of the box's weight: the box stands on something once the grip carries less."""


@dataclass(frozen=True)
class PickAndPlaceGeometry:
    """What the robot knows of box, goal and itself; true are only the sizes.

    Attributes:
        X_BO: Tag on the box in B [m].
        X_BP: Platform in B while the box is gripped as planned [m].
        X_GT: Tag of the goal in G, which is B when the box is set down [m].
        X_PC_object: Camera that looks at the box, on the platform [m].
        X_PC_goal: Camera that looks at the goal, on the platform [m].
        X_WB: Where the box is expected [m].
        X_WG: Where the goal is expected [m].
        weight: Of the box [N].
    """

    X_BO: RigidTransform
    X_BP: RigidTransform
    X_GT: RigidTransform
    X_PC_object: RigidTransform
    X_PC_goal: RigidTransform
    X_WB: RigidTransform
    X_WG: RigidTransform
    weight: float


@dataclass(frozen=True)
class PickAndPlaceRules:
    """When phases end; units and meanings as in the scenario's section `handling`.

    Attributes:
        hover: [m].
        distance: [m].
        angle: [rad].
        hold: [s].
        passing_distance: [m].
        fresh: [s].
        blind: [s].
        pause: [s].
        phase_limit: [s].
        smoothing: Least share of a new sighting.
        period: Time between steps [s].
    """

    hover: float
    distance: float
    angle: float
    hold: float
    passing_distance: float
    fresh: float
    blind: float
    pause: float
    phase_limit: float
    smoothing: float
    period: float


@dataclass(frozen=True, eq=False)
class PickAndPlaceState:
    """Where a task stands.

    Attributes:
        phase: The phase.
        began: When it began [s].
        failed_in: Phase that failed; that of the task where nothing failed.
        failure: Why.
        reached: Since when the phase's end is reached, or -1 [s].
        last_seen: When the tag that the phase looks at was seen last, or -1 if not in it [s].
        X_WB: Believed pose of the box where it was taken [m].
        X_WG: Believed pose of the goal [m].
        X_PB: Believed pose of the box in the gripper [m].
        X_WP: Estimated pose of the platform at the step before [m].
        sightings: Of the box on the ground, of the goal, of the box in the gripper, shape (3,).
        losses: How often a tag that was needed went out of view.
        blind_time: How long in all [s].
        time: Time of the step [s].
    """

    phase: Phase
    began: float
    failed_in: Phase
    failure: Failure
    reached: float
    last_seen: float
    X_WB: RigidTransform
    X_WG: RigidTransform
    X_PB: RigidTransform
    X_WP: RigidTransform
    sightings: Array
    losses: float
    blind_time: float
    time: float

    def is_new(self) -> bool:
        """Whether the phase began at this step."""
        return self.time == self.began

    def packed(self) -> Array:
        """All of it as numbers, shape (STATE_SIZE,)."""
        poses = (pose_row(X) for X in (self.X_WB, self.X_WG, self.X_PB, self.X_WP))
        return np.concatenate([
            [self.phase, self.began, self.failed_in, self.failure, self.reached, self.last_seen],
            *poses, self.sightings, [self.losses, self.blind_time, self.time],
        ])  # fmt: skip

    @staticmethod
    def unpacked(numbers: Array) -> PickAndPlaceState:
        """From the numbers of `packed`."""
        poses = [pose_from_row(row) for row in numbers[6:34].reshape(4, 7)]
        return PickAndPlaceState(
            Phase(int(numbers[0])), float(numbers[1]), Phase(int(numbers[2])),
            Failure(int(numbers[3])), float(numbers[4]), float(numbers[5]), poses[0],
            poses[1], poses[2], poses[3], np.array(numbers[34:37]), float(numbers[37]),
            float(numbers[38]), float(numbers[39]),
        )  # fmt: skip


STATE_SIZE = 40
"""Numbers of a packed `PickAndPlaceState`."""


@dataclass(frozen=True)
class Reading:
    """What a step gets.

    Attributes:
        time: Time [s].
        X_WP: Estimated pose of the platform [m].
        X_CO: Box's tag in its camera at the step before, None: not seen [m].
        X_CT: Goal's tag in its camera at the step before, None: not seen [m].
        holding: Whether the gripper holds something.
        load: Force that the grip carries along the tip's axis [N].
    """

    time: float
    X_WP: RigidTransform
    X_CO: RigidTransform | None
    X_CT: RigidTransform | None
    holding: bool
    load: float


class PickAndPlaceTask:
    """The task; see the module."""

    def __init__(self, geometry: PickAndPlaceGeometry, rules: PickAndPlaceRules) -> None:
        """With what is known and when phases end."""
        self.geometry, self.rules = geometry, rules

    def start(self, X_WP: RigidTransform) -> PickAndPlaceState:
        """Before the first step, from the believed pose of the platform [m]."""
        known = self.geometry
        return PickAndPlaceState(
            Phase.APPROACH, 0.0, Phase.APPROACH, Failure.NONE, -1.0, -1.0,
            known.X_WB, known.X_WG, known.X_BP.inverse(), X_WP, np.zeros(3), 0.0, 0.0, 0.0,
        )  # fmt: skip

    def aim(self, state: PickAndPlaceState) -> RigidTransform | None:
        """Where the platform shall go, X_WP as it is estimated [m]; None: it rests."""
        phase, known = state.phase, self.geometry
        if phase in RESTS:
            return None
        height = self.rules.hover if phase in PASSED else -PRESS if phase is Phase.LOWER else 0.0
        up = RigidTransform([0.0, 0.0, height])
        if phase <= Phase.LIFT:
            return state.X_WB @ up @ known.X_BP
        return state.X_WG @ up @ state.X_PB.inverse()

    def step(self, state: PickAndPlaceState, reading: Reading) -> PickAndPlaceState:
        """The state after a step; the one before it is not changed."""
        state = replace(self._look(state, reading), time=reading.time)
        if state.phase in (Phase.DONE, Phase.FAILED):
            return replace(state, X_WP=reading.X_WP)
        failure = self._failure(state, reading)
        if failure is not Failure.NONE:
            return replace(
                state, phase=Phase.FAILED, began=reading.time, failed_in=state.phase,
                failure=failure, X_WP=reading.X_WP,
            )  # fmt: skip
        reached = self._reached_since(state, reading)
        state = replace(state, reached=reached, X_WP=reading.X_WP)
        if not self._is_over(state, reading):
            return state
        after = Phase(state.phase + 1)
        return replace(
            state, phase=after, failed_in=after, began=reading.time, reached=-1.0, last_seen=-1.0
        )

    def _look(self, state: PickAndPlaceState, reading: Reading) -> PickAndPlaceState:
        """Corrects what is believed by what the image of the step before shows."""
        phase, known = state.phase, self.geometry
        seen = self._seen(state, reading)
        if seen is None:
            return self._count_blindness(state, reading)
        seen_by = known.X_PC_goal if phase in LOOKS_AT_GOAL else known.X_PC_object
        X_PT = seen_by @ seen
        times = np.array(state.sightings)
        if phase in LOOKS_AT_GOAL:
            X_WG = state.X_WP @ X_PT @ known.X_GT.inverse()
            changes = {"X_WG": self._blend(state.X_WG, X_WG, times[1])}
            times[1] += 1.0
        elif phase in CARRIES:
            X_PB = X_PT @ known.X_BO.inverse()
            changes = {"X_PB": self._blend(state.X_PB, X_PB, times[2])}
            times[2] += 1.0
        else:
            X_WB = state.X_WP @ X_PT @ known.X_BO.inverse()
            changes = {"X_WB": self._blend(state.X_WB, X_WB, times[0])}
            times[0] += 1.0
        return replace(state, last_seen=reading.time, sightings=times, **changes)

    def _seen(self, state: PickAndPlaceState, reading: Reading) -> RigidTransform | None:
        if state.phase in LOOKS_AT_GOAL:
            return reading.X_CT
        return reading.X_CO if state.phase in LOOKS_AT_OBJECT else None

    def _blend(self, old: RigidTransform, new: RigidTransform, times: float) -> RigidTransform:
        """The mean of the first sightings, later a share of the way from old to new."""
        share = max(self.rules.smoothing, 1.0 / (times + 1.0))
        return old @ exponential(share * logarithm(old.inverse() @ new))

    def _count_blindness(self, state: PickAndPlaceState, reading: Reading) -> PickAndPlaceState:
        """Counts views that were lost; a phase that has not seen its tag yet has lost nothing."""
        if state.phase not in NEEDS_TAG or state.last_seen < 0.0:
            return state
        missed, period = reading.time - state.last_seen, self.rules.period
        if missed <= self.rules.fresh:
            return state
        first = missed - period <= self.rules.fresh
        more = missed if first else period
        return replace(
            state, losses=state.losses + float(first), blind_time=state.blind_time + more
        )

    def _failure(self, state: PickAndPlaceState, reading: Reading) -> Failure:
        rules, phase = self.rules, state.phase
        waited = reading.time - max(state.last_seen, state.began)
        if phase in NEEDS_TAG and waited > rules.blind:
            return Failure.TAG_NOT_SEEN
        if phase in CARRIES and not reading.holding:
            return Failure.DROPPED
        passed = reading.time - state.began
        if phase is Phase.GRASP and self._has_paused(state, reading) and not reading.holding:
            return Failure.NOT_GRASPED
        return Failure.TOO_LONG if passed > rules.phase_limit else Failure.NONE

    def _reached_since(self, state: PickAndPlaceState, reading: Reading) -> float:
        """Since when the phase's end is reached [s], or -1."""
        aim = self.aim(state)
        if aim is None:
            return -1.0
        rules, phase = self.rules, state.phase
        offset = (aim.inverse() @ reading.X_WP).translation()
        distance, angle = pose_error(aim, reading.X_WP)
        if phase is Phase.LOWER:  # it ends on the ground, wherever that is
            stands = reading.load < SUPPORTED * self.geometry.weight
            distance = float(np.linalg.norm(offset[:2])) if stands else np.inf
        wide = rules.passing_distance / rules.distance if phase in PASSED else 1.0
        near = distance <= wide * rules.distance and angle <= wide * rules.angle
        if phase in NEEDS_TAG and not 0.0 <= reading.time - state.last_seen <= rules.fresh:
            near = False
        if phase is Phase.LIFT and state.sightings[2] == 0.0:
            near = False
        if not near:
            return -1.0
        return state.reached if state.reached >= 0.0 else reading.time

    def _is_over(self, state: PickAndPlaceState, reading: Reading) -> bool:
        rules = self.rules
        if state.phase in RESTS:
            return self._has_paused(state, reading)
        return state.reached >= 0.0 and reading.time - state.reached >= rules.hold - NOW

    def _has_paused(self, state: PickAndPlaceState, reading: Reading) -> bool:
        return reading.time - state.began >= self.rules.pause - NOW
