"""Watches a servo run and ends it with an outcome."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import place_error
from cdpr_drake.servoing.pose_features import seen_pose_error

NOT_YET = (-1.0, -1.0)
"""Times since when the pose is reached and the target lost, where neither is [s]."""


class Outcome(IntEnum):
    """How a run stands or ended; the names in lower case are those of `summary.json`."""

    RUNNING = 0
    CONVERGED = 1
    TARGET_LOST = 2
    TIMEOUT = 3
    DIVERGED = 4
    INTERRUPTED = 5
    COMPLETED = 6
    CABLE_BROKEN = 7
    CLIENT_ENDED = 8
    CONTACT = 9
    FAILED = 10


@dataclass(frozen=True)
class StopRules:
    """When a run ends.

    Attributes:
        position: Measured distance to the desired pose that counts as reached [m].
        rotation: Measured angle that counts as reached [rad].
        hold: Time for which both must stay reached [s].
        lost: Time without the target after which the run ends [s].
        lower: Lower corner of the box that the platform must stay in, shape (3,) [m].
        upper: Upper corner, shape (3,) [m].
    """

    position: float
    rotation: float
    hold: float
    lost: float
    lower: Array
    upper: Array


class RunMonitor(LeafSystem):
    """Ends a run when the desired pose is held, the target is lost or the platform leaves.

    ========== ============== ==== ==========================================================
    port       type           unit meaning
    ========== ============== ==== ==========================================================
    X_CO       RigidTransform m    in, measured pose of the target in C
    found      vector(1)      -    in, 1 while the tag is seen
    X_WP       RigidTransform m    in, true pose of the platform
    outcome    vector(1)      -    out, an `Outcome`
    ========== ============== ==== ==========================================================

    When the outcome is known, the simulator is told to terminate.

    Attributes:
        rules: When the run ends.
        X_CdO: Desired pose of the target in the camera [m].
        free_rotation: Whether the rotation about the optical axis does not count.
        earliest: Time before which the pose does not count as reached [s].
    """

    def __init__(
        self,
        rules: StopRules,
        X_CdO: RigidTransform,
        rate: float,
        free_rotation: bool = False,
        earliest: float = 0.0,
        completed: float = np.inf,
    ) -> None:
        """With the desired pose X_CdO of the target in the camera [m], looking at `rate` [Hz].

        With `free_rotation` the rotation about the optical axis does not count; before the time
        `earliest` [s], when the last task begins, the pose does not count as reached. A finite time
        `completed` [s] ends the run instead of what is seen.
        """
        super().__init__()
        self.rules, self.X_CdO = rules, X_CdO
        self._box = list(zip(rules.lower.tolist(), rules.upper.tolist(), strict=True))
        self.free_rotation, self.earliest = free_rotation, earliest
        self._completed = completed
        self.DeclareAbstractInputPort("X_CO", Value(RigidTransform()))
        self.DeclareVectorInputPort("found", 1)
        self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        # Since when the pose is reached and the tag is lost (negative: it is not); the outcome.
        self._since = self.DeclareDiscreteState(np.array(NOT_YET))
        self._outcome = self.DeclareDiscreteState(np.array([float(Outcome.RUNNING)]))
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rate, 0.0, self._update)
        self.DeclarePeriodicPublishEvent(1.0 / rate, 0.0, self._terminate)
        self.DeclareVectorOutputPort(
            "outcome", 1, self._calc_outcome, {self.discrete_state_ticket(self._outcome)}
        )

    def outcome(self, context: Context) -> Outcome:
        """The outcome so far, from this system's own context."""
        return Outcome(int(context.get_discrete_state(self._outcome).value()[0]))

    def _calc_outcome(self, context: Context, output: BasicVector) -> None:
        output.set_value([float(self.outcome(context))])

    def _update(self, context: Context, state: DiscreteValues) -> None:
        since, outcome = self.judge(
            lambda name: self.GetInputPort(name).Eval(context),
            context.get_discrete_state(self._since).value(),
            context.get_time(),
        )
        state.set_value(self._since, since)
        state.set_value(self._outcome, [float(outcome)])

    def judge(
        self, read: Callable[[str], Any], since: Array | tuple[float, float], now: float
    ) -> tuple[tuple[float, float], Outcome]:
        """How the run stands at a time [s], and since when the pose is reached, the target lost.

        Args:
            read: Gives what stands at an input, by its name.
            since: The same times after the step before, `NOT_YET` at the start [s].
            now: Time [s].
        """
        rules = self.rules
        reached_since, lost_since = since
        found = read("found")[0] != 0.0
        reached = False
        if found and now >= self.earliest:
            X_CO = read("X_CO")
            if place_error(X_CO, self.X_CdO) <= rules.position:  # else no angle matters
                _, angle = seen_pose_error(X_CO, self.X_CdO, self.free_rotation)
                reached = angle <= rules.rotation
        reached_since = _running_since(reached, reached_since, now)
        lost_since = _running_since(not found, lost_since, now)
        outcome = Outcome.RUNNING
        if _is_outside(read("X_WP").translation().tolist(), self._box):
            outcome = Outcome.DIVERGED
        elif math.isfinite(self._completed):
            outcome = Outcome.COMPLETED if now >= self._completed - 1e-9 else Outcome.RUNNING
        elif lost_since >= 0.0 and now - lost_since >= rules.lost:
            outcome = Outcome.TARGET_LOST
        elif reached_since >= 0.0 and now - reached_since >= rules.hold:
            outcome = Outcome.CONVERGED
        return (reached_since, lost_since), outcome

    def _terminate(self, context: Context) -> EventStatus:
        outcome = self.outcome(context)
        if outcome == Outcome.RUNNING:
            return EventStatus.Succeeded()
        return EventStatus.ReachedTermination(self, outcome.name.lower())


def _is_outside(position: list[float], box: list[tuple[float, float]]) -> bool:
    """Plain numbers, as three of them are compared sooner than an array."""
    (x, y, z), ((x0, x1), (y0, y1), (z0, z1)) = position, box
    return x < x0 or y < y0 or z < z0 or x > x1 or y > y1 or z > z1


def _running_since(condition: bool, since: float, now: float) -> float:
    if not condition:
        return -1.0
    return now if since < 0.0 else since
