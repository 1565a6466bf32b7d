"""Finds broken cables by lengths and tensions."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from cdpr_drake.estimation.failure_detection import AlarmRule, length_residuals
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet


class BreakDetector(LeafSystem):
    """Which cables are broken, by what should be taut and does not pull.

    ============ ============== ==== ===========================================================
    port         type           unit meaning
    ============ ============== ==== ===========================================================
    X_WP         RigidTransform m    in, believed pose of the platform
    tensions     vector(m)      N    in, measured
    lengths      vector(m)      m    in, measured unstrained lengths
    found_broken vector(m)      -    out, 1 for each cable found to be broken, from then on
    residuals    vector(m)      m    out, of the last sample
    ============ ============== ==== ===========================================================

    Residuals raise the alarm; which cable it is the tensions tell: of those that read nothing the
    one that fell most from one sample to the next when it fell silent, since a cable that breaks
    lets go at once, and others slacken after it. Where none fell, that of the largest residual.
    Looks for one break: with the platform thrown about by that, the belief tells of no other.

    Samples its inputs at a rate. What is wrong with the belief at the start, pose, lengths and
    sensors, is taken off: the residuals are those beyond the first ones, as far as these are above
    zero. A cable that begins slack begins below.

    Raises CableGeometryError where a cable cannot run at the believed pose.
    """

    def __init__(
        self, cables: CableSet, rule: AlarmRule, rate: float, slack_below: float = np.inf
    ) -> None:
        """With the cables as they are believed to be, when to raise an alarm, a rate [Hz], and the
        measured tension below which a cable may be broken [N]."""
        super().__init__()
        self._cables, self.rule, m = cables, rule, cables.count
        self._slack_below = slack_below
        self._m = m
        self._X_WP = self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        self._tensions = self.DeclareVectorInputPort("tensions", m)
        self._lengths = self.DeclareVectorInputPort("lengths", m)
        # Counts, residuals, falls; where residuals began and the last tensions, NaN before any.
        state = self.DeclareDiscreteState(np.concatenate([np.zeros(3 * m), np.full(2 * m, np.nan)]))
        needs = {self.discrete_state_ticket(state)}
        self.DeclareVectorOutputPort("found_broken", m, self._calc_found, needs)
        self.DeclareVectorOutputPort("residuals", m, self._calc_residuals, needs)
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rate, 0.0, self._update)

    def _parts(self, context: Context) -> np.ndarray:
        return context.get_discrete_state_vector().value().reshape(5, self._m)

    def _calc_found(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector((self._parts(context)[0] >= self.rule.in_a_row).astype(float))

    def _calc_residuals(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._parts(context)[1])

    def _update(self, context: Context, state: DiscreteValues) -> None:
        counts, _, falls, began, before = self._parts(context)
        lengths = cable_paths(self._X_WP.Eval(context), self._cables).lengths
        tensions = self._tensions.Eval(context)
        found = length_residuals(
            lengths, self._lengths.Eval(context), tensions, self._cables.stiffness
        )
        if np.isnan(began[0]):
            began = np.maximum(found, 0.0)
        residuals, silent = found - began, tensions < self._slack_below
        fell = silent & (before >= self._slack_below)
        falls = np.where(fell, before - tensions, np.where(silent, falls, 0.0))
        if np.all(counts < self.rule.in_a_row):
            # One that pulls is there, whatever the belief says of its length.
            suspect = np.where(silent, residuals, -np.inf)
            counts, alarms = self.rule.step(counts, suspect)
            if np.any(alarms):
                told = falls if np.any(falls > 0.0) else suspect
                first = int(np.argmax(told))
                counts = np.zeros(self._m)
                counts[first] = self.rule.in_a_row
        state.set_value(np.concatenate([counts, residuals, falls, began, tensions]))
