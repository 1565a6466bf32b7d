"""What all estimators of the platform's pose share: the port, the clock, the known tag."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem, ValueProducer

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.pose_from_images import pose_from_object
from cdpr_drake.geometry.poses import write_pose

NOW = 1e-9
"""Times that differ by less are the same instant [s]."""

Read = Callable[[str], Any]
"""Reads an input port by its name; what `PoseEstimator.advance` gets as `read`."""

_UPDATED, _DUE, _RESET = 0, 1, 2
_POSE = slice(3, 15)
_EXTRA = 15


@dataclass(frozen=True)
class KnownTag:
    """A tag in the scene whose pose is known, and when an estimator begins anew from it.

    Attributes:
        X_WK: Pose of the tag in W [m].
        X_PC: Camera C on the platform, as believed [m].
        period: Time between two new beginnings; the first one is a period after the start [s].
    """

    X_WK: RigidTransform
    X_PC: RigidTransform
    period: float


class PoseEstimator(LeafSystem):
    """Base of the estimators: the pose of the platform at control steps, from whatever is read.

    =============== ============== ==== =======================================================
    port            type           unit meaning
    =============== ============== ==== =======================================================
    X_CK            RigidTransform m    in, measured pose of the known tag; only if there is one
    known_tag_found vector(1)      -    in, 1 while it is seen; only if there is one
    (others)        any            any  in, what the estimator needs and nothing else
    X_WP            RigidTransform m    out, estimated pose of the platform
    =============== ============== ==== =======================================================

    At a control step the port gives the estimate with the measurements of that instant already in
    it, though the state takes them over at the end of the instant: a controller that updates at the
    same time reads what is new. What was computed for the one is cached for the other.

    With a known tag the estimate begins anew at the tag's measurement, at the first control step
    after each period at which the tag is seen.

    What it does is `start`, `upcoming` and `estimate`, which know no context: a loop without a
    diagram calls them as this block does.
    """

    def __init__(
        self, X_WP0: RigidTransform, rate: float, extra: Array, known_tag: KnownTag | None = None
    ) -> None:
        """With the pose believed at the start [m], control steps per second [Hz] and the memory of
        the estimator besides the pose at the start."""
        super().__init__()
        self._period = 1.0 / rate
        self._known_tag = known_tag
        first_reset = np.inf if known_tag is None else known_tag.period
        start = np.concatenate([[0.0, 0.0, first_reset], pack_pose(X_WP0), extra])
        self._beginning = start
        self._memory = self.DeclareDiscreteState(start)
        self.DeclarePeriodicDiscreteUpdateEvent(self._period, 0.0, self._update)
        if known_tag is not None:
            self.DeclareAbstractInputPort("X_CK", Value(RigidTransform()))
            self.DeclareVectorInputPort("known_tag_found", 1)
        self._upcoming = self.DeclareCacheEntry(
            "upcoming",
            ValueProducer(allocate=lambda: Value[object](start.copy()), calc=self._calc_upcoming),
        )
        self.DeclareAbstractOutputPort("X_WP", lambda: Value(RigidTransform()), self._calc_pose)

    @abstractmethod
    def advance(
        self, read: Read, X_WP: RigidTransform, extra: Array, elapsed: float
    ) -> tuple[RigidTransform, Array]:
        """Estimate and memory now, from those of `elapsed` seconds ago."""

    def between(self, read: Read, X_WP: RigidTransform, elapsed: float) -> RigidTransform:
        """Estimate `elapsed` seconds after a control step, before the next: that of the step."""
        return X_WP

    def restart(self, read: Read, X_WP: RigidTransform, extra: Array) -> Array:
        """Memory now, when the pose is known from elsewhere: as it was."""
        return extra

    def memory(self, context: Context) -> tuple[RigidTransform, Array]:
        """Pose and memory after the last control step, from this system's own context."""
        memory = context.get_discrete_state(self._memory).value()
        return unpack_pose(memory[_POSE]), np.array(memory[_EXTRA:])

    def memory_now(self, context: Context) -> Array:
        """The whole memory as a controller finds it now, after a control step that is due, from
        this system's own context."""
        memory: Array = context.get_discrete_state(self._memory).value()
        if self.is_due(memory, context.get_time()):
            memory = self._upcoming.Eval(context)
        return memory

    def memory_done(self, context: Context) -> Array:
        """The whole memory after the last control step that is over, from this system's own
        context."""
        return np.array(context.get_discrete_state(self._memory).value())

    def parts_of(self, memory: Array) -> tuple[RigidTransform, Array]:
        """Pose and the estimator's own part of the whole memory."""
        return unpack_pose(memory[_POSE]), np.array(memory[_EXTRA:])

    def start(self) -> Array:
        """The whole memory before the first control step, with its times and its pose."""
        return self._beginning.copy()

    def is_due(self, memory: Array, now: float) -> bool:
        """Whether a control step is due at a time [s], by the whole memory."""
        return bool(now >= memory[_DUE] - NOW)

    def believed(self, memory: Array) -> RigidTransform:
        """The pose that the whole memory holds, that of the last control step."""
        return unpack_pose(memory[_POSE])

    def upcoming(self, read: Read, memory: Array, now: float, X_WP: RigidTransform) -> Array:
        """The whole memory after a control step at a time [s], from that before it, which
        `believed` finds at X_WP."""
        X_WP, extra = self.advance(read, X_WP, memory[_EXTRA:], now - memory[_UPDATED])
        reset, tag = memory[_RESET], self._known_tag
        if tag is not None and now >= reset - NOW and read("known_tag_found")[0] != 0.0:
            X_WP = pose_from_object(tag.X_WK, tag.X_PC, read("X_CK"))
            extra = self.restart(read, X_WP, extra)
            reset = now + tag.period
        after = np.empty(len(memory))
        after[_UPDATED], after[_DUE], after[_RESET] = now, now + self._period, reset
        write_pose(X_WP, after[_POSE])
        if len(extra):
            after[_EXTRA:] = extra
        return after

    def estimate(
        self, read: Read, memory: Array, now: float, X_WP: RigidTransform
    ) -> RigidTransform:
        """The pose at a time [s], from the whole memory after the last control step, which
        `believed` finds at X_WP."""
        return self.between(read, X_WP, now - memory[_UPDATED])

    def _reader(self, context: Context) -> Read:
        return lambda name: self.GetInputPort(name).Eval(context)

    def _calc_upcoming(self, context: Context, output: AbstractValue) -> None:
        memory = context.get_discrete_state(self._memory).value()
        now, X_WP = context.get_time(), self.believed(memory)
        output.set_value(self.upcoming(self._reader(context), memory, now, X_WP))

    def _update(self, context: Context, state: DiscreteValues) -> None:
        state.set_value(self._memory, self._upcoming.Eval(context))

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        memory, now = self.memory_now(context), context.get_time()
        X_WP = self.believed(memory)
        output.set_value(self.estimate(self._reader(context), memory, now, X_WP))


def pack_pose(X: RigidTransform) -> Array:
    """A pose as numbers for a state: rotation row by row, position; shape (12,)."""
    values = np.empty(12)
    write_pose(X, values)
    return values


def unpack_pose(values: Array) -> RigidTransform:
    """Inverse of `pack_pose`; rounding that has grown in the rotation is removed."""
    R = RotationMatrix.ProjectToRotationMatrix(values[:9].reshape(3, 3))
    return RigidTransform(R, values[9:12])
