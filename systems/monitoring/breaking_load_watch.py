"""Watches for cables that are pulled beyond their breaking load."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus, LeafSystem

from cdpr_drake.arrays import Array


class BreakingLoadWatch(LeafSystem):
    """Remembers when each cable's tension first passed its breaking load.

    ======== ========= ==== =================================================================
    port     type      unit meaning
    ======== ========= ==== =================================================================
    tensions vector(m) N    in
    broken   vector(m) s    out, time at which a cable would have broken, or -1
    ======== ========= ==== =================================================================

    It looks once an integration step. The simulated cable goes on pulling: what happens after is
    that of a stronger cable. If asked, the simulator is told to terminate.
    """

    def __init__(self, breaking_load: Array, stop: bool) -> None:
        """With breaking loads, shape (m,) [N], and whether the first break ends the simulation."""
        super().__init__()
        self._loads, self._stop = np.array(breaking_load, float), stop
        m = len(self._loads)
        self._tensions = self.DeclareVectorInputPort("tensions", m).Eval
        self._since = self.DeclareDiscreteState(np.full(m, -1.0))
        self.DeclarePerStepDiscreteUpdateEvent(self._update)
        if stop:
            self.DeclarePerStepPublishEvent(self._terminate)
        self.DeclareVectorOutputPort("broken", m, self._calc, {self.xd_ticket()})

    def broken(self, context: Context) -> Array:
        """Times at which cables would have broken, or -1, shape (m,), from its own context [s]."""
        return np.array(context.get_discrete_state(self._since).value())

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.set_value(self.broken(context))

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        over = self._tensions(context) > self._loads
        if not np.any(over):
            return EventStatus.DidNothing()
        since = self.broken(context)
        state.set_value(self._since, np.where(over & (since < 0.0), context.get_time(), since))
        return EventStatus.Succeeded()

    def _terminate(self, context: Context) -> EventStatus:
        if np.all(self.broken(context) < 0.0):
            return EventStatus.DidNothing()
        return EventStatus.ReachedTermination(self, "cable_broken")
