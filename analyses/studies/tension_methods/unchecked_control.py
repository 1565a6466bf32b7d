"""Control by tensions as the Gazebo thesis runs it: what a method computes is applied unchecked."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues

from cdpr_drake.systems.tension_control import TensionDistributor
from cdpr_drake.tensions import METHODS

BALANCE = 1e-6
"""Tensions balance the wrench if they miss it by at most this, relative to the cables' forces."""


class UncheckedDistributor(TensionDistributor):
    """A `TensionDistributor` that puts out what its method computes, outside the bounds too.

    Its ports are those of `TensionDistributor`; `failures` counts the control steps whose tensions
    left the bounds all the same. An exact method has no answer where there is none within the
    bounds, and what does not balance the wrench is none either: then the last tensions are held.
    """

    def _update(self, context: Context, state: DiscreteValues) -> None:
        super()._update(context, state)
        met = state.get_value(self._feasible)[0] == 1.0
        if met or METHODS[self._method].exact or not np.all(np.isfinite(self._t)):
            return
        missing = self._W @ self._t - self._wrench(context)[self._rows]
        if np.linalg.norm(missing) <= BALANCE * np.linalg.norm(np.abs(self._W) @ np.abs(self._t)):
            state.get_mutable_value(self._tensions)[:] = self._t
