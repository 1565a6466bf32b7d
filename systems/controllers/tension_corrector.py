"""Adds to a servo's cable velocities what takes up slack, at a rate of its own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.systems.controllers.correction_laws import CorrectionLaw, CorrectionReadings


class TensionCorrector(LeafSystem):
    """Tension management between a servo and the winches.

    ==================== ============== ==== =================================================
    port                 type           unit meaning
    ==================== ============== ==== =================================================
    commanded_velocities vector(m)      m/s  in, cable velocities of the servo
    tensions             vector(m)      N    in, measured
    lengths              vector(m)      m    in, unstrained lengths that the winches count
    X_WP                 RigidTransform m    in, believed pose of the platform
    cable_points         vector(2 m n)  px   in, from `CableCamera`; only for laws that look
    cable_surplus        vector(2 m)    m    in, from `CablePictureCamera`; only for laws that look
                                             at rendered images
    cable_velocities     vector(m)      m/s  out, to the winches, positive pays out
    tension_corrections  vector(m)      m/s  out, of these what was added
    tension_thresholds   vector(m)      N    out, NaN for a law without
    correction_failures  vector(1)      -    out, steps at which the law had no answer
    ==================== ============== ==== =================================================

    Samples its inputs at a rate of its own, which may be faster than the servo's; what it adds is
    held until the next step.

    Source: servoing thesis 5.2, Figs 5.2 to 5.4.
    """

    def __init__(
        self,
        law: CorrectionLaw,
        cables: int,
        rate: float,
        image_points: int = 0,
        detected: bool = False,
    ) -> None:
        """With a law for a number of cables, asked at a rate [Hz], that looks at so many points of
        each in an image; 0: at none; or at surplus lengths that were `detected`."""
        super().__init__()
        self._law, self.period = law, 1.0 / rate
        self._commanded = self.DeclareVectorInputPort("commanded_velocities", cables)
        self.DeclareVectorInputPort("tensions", cables)
        self.DeclareVectorInputPort("lengths", cables)
        self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        if image_points:
            self.DeclareVectorInputPort("cable_points", 2 * cables * image_points)
        if detected:
            self.DeclareVectorInputPort("cable_surplus", 2 * cables)
        self._added = self.DeclareDiscreteState(cables)
        self._thresholds = self.DeclareDiscreteState(np.full(cables, np.nan))
        self._failures = self.DeclareDiscreteState(1)
        self._memory = self.DeclareDiscreteState(law.memory)
        self.DeclarePeriodicDiscreteUpdateEvent(self.period, 0.0, self._update)
        self.DeclareForcedDiscreteUpdateEvent(self._update)
        self.DeclareVectorOutputPort(
            "cable_velocities",
            cables,
            self._calc_velocities,
            {self._commanded.ticket(), self.discrete_state_ticket(self._added)},
        )
        self.DeclareStateOutputPort("tension_corrections", self._added)
        self.DeclareStateOutputPort("tension_thresholds", self._thresholds)
        self.DeclareStateOutputPort("correction_failures", self._failures)

    def _calc_velocities(self, context: Context, output: BasicVector) -> None:
        added = context.get_discrete_state(self._added).value()
        output.set_value(self._commanded.Eval(context) + added)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        added, thresholds, could = self.correct(
            lambda name: self.GetInputPort(name).Eval(context),
            state.get_mutable_value(self._memory),
        )
        state.set_value(self._added, added)
        state.set_value(self._thresholds, thresholds)
        if not could:
            state.get_mutable_value(self._failures)[0] += 1.0

    def no_memory(self) -> Array:
        """The law's memory before the first step."""
        return np.zeros(self._law.memory)

    def correct(self, read: Callable[[str], Any], memory: Array) -> tuple[Array, Array, bool]:
        """One step: what is added, thresholds, whether the law could; see `CorrectionLaw.step`.

        Args:
            read: Gives what stands at an input, by its name.
            memory: The law's memory; changed in place.
        """
        return self._law.step(CorrectionReadings(read, self.period), memory)
