"""Finds broken cables by lengths and tensions."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.estimation.break_detection import BreakRule, fresh_memory
from cdpr_drake.estimation.break_detection_kernel import (
    MEMORY_ROWS,
    NAMED,
    RESIDUALS,
    break_step,
)
from cdpr_drake.geometry.cable_paths import impossible_cable, motion_of
from cdpr_drake.geometry.cable_set import CableSet


class BreakDetector(LeafSystem):
    """Which cable is broken, by what should be taut and does not pull.

    ============ ============== ==== ===========================================================
    port         type           unit meaning
    ============ ============== ==== ===========================================================
    X_WP         RigidTransform m    in, believed pose of the platform
    tensions     vector(m)      N    in, measured
    lengths      vector(m)      m    in, measured unstrained lengths
    found_broken vector(m)      -    out, 1 for the cable that is found to be broken
    residuals    vector(m)      m    out, of the last sample
    ============ ============== ==== ===========================================================

    Samples its inputs at a rate; see `estimation.break_detection_kernel` for what it makes of them.
    It names one cable at a time, and takes that back when the cable pulls.

    Raises CableGeometryError where a cable cannot run at the believed pose.
    """

    def __init__(
        self, cables: CableSet, rule: BreakRule, rate: float, silent: Array | float = np.inf
    ) -> None:
        """With the cables as they are believed to be, when to raise an alarm, a rate [Hz], and what
        sensors read at most of cables that pull nothing, shape (m,) or for all [N]."""
        super().__init__()
        self._cables, self.rule, m = cables, rule, cables.count
        self._silent = np.ascontiguousarray(np.broadcast_to(np.asarray(silent, float), (m,)))
        self._packed, self._rows = rule.packed(), cables.packed()
        self._X_WP = self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        self._tensions = self.DeclareVectorInputPort("tensions", m)
        self._lengths = self.DeclareVectorInputPort("lengths", m)
        state = self.DeclareDiscreteState(fresh_memory(m).ravel())
        needs = {self.discrete_state_ticket(state)}
        for name, row in (("found_broken", NAMED), ("residuals", RESIDUALS)):

            def write(context: Context, output: BasicVector, row: int = row) -> None:
                output.SetFromVector(self._memory(context)[row])

            self.DeclareVectorOutputPort(name, m, write, needs)
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rate, 0.0, self._update)

    def _memory(self, context: Context) -> Array:
        memory: Array = context.get_discrete_state_vector().value()
        return memory.reshape(MEMORY_ROWS, self._cables.count)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        memory, X_WP = self._memory(context).copy(), self._X_WP.Eval(context)
        bad = break_step(
            motion_of(X_WP), self._rows, self._lengths.Eval(context), self._tensions.Eval(context),
            self._silent, self._packed, memory,
        )  # fmt: skip
        if bad >= 0:
            raise CableGeometryError(impossible_cable(X_WP, self._cables))
        state.set_value(memory.ravel())
