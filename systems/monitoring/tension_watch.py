"""Watches of tensions: how far they went, and which cables were pulled beyond their breaking load.

They look at every step of a control, not only where a log has rows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteStateIndex,
    DiscreteValues,
    EventStatus,
    LeafSystem,
)

from cdpr_drake.arrays import Array


@dataclass(frozen=True)
class TensionExtremes:
    """What a `TensionRange` saw.

    Attributes:
        taut_since: When every cable had pulled with the lower limit, all at the same time, for the
            first time; infinite if never [s].
        lowest: Smallest tensions from then on, shape (m,); infinite if never [N].
        highest: Largest tensions since the start, shape (m,) [N].
    """

    taut_since: float
    lowest: Array
    highest: Array


class TensionRange(LeafSystem):
    """Smallest and largest tensions of a run, the true ones.

    ======== ========= ==== =========================================================
    port     type      unit meaning
    ======== ========= ==== =========================================================
    tensions vector(m) N    in
    lowest   vector(m) N    out, since all cables pulled; infinite before
    highest  vector(m) N    out, since the start
    ======== ========= ==== =========================================================

    It looks at every step of the simulator.
    """

    def __init__(self, count: int, lower: float) -> None:
        """For m = `count` cables that count as pulling from a tension [N] on."""
        super().__init__()
        self._lower, m = lower, count
        self._tensions = self.DeclareVectorInputPort("tensions", m).Eval
        self._taut = self.DeclareDiscreteState(np.array([np.inf]))
        self._lowest = self.DeclareDiscreteState(np.full(m, np.inf))
        self._highest = self.DeclareDiscreteState(m)
        self.DeclarePerStepDiscreteUpdateEvent(self._update)
        for name, index in (("lowest", self._lowest), ("highest", self._highest)):
            self.DeclareVectorOutputPort(
                name, m, self._reader(index), {self.discrete_state_ticket(index)}
            )

    def _reader(self, index: DiscreteStateIndex) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            output.set_value(context.get_discrete_state(index).value())

        return calc

    def extremes(self, context: Context) -> TensionExtremes:
        """What was seen so far, from this system's own context."""
        value = context.get_discrete_state
        return TensionExtremes(
            float(value(self._taut).value()[0]),
            np.array(value(self._lowest).value()),
            np.array(value(self._highest).value()),
        )

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        tensions, seen = self._tensions(context), self.extremes(context)
        state.set_value(self._highest, np.maximum(tensions, seen.highest))
        taut = seen.taut_since
        if np.isinf(taut) and np.all(tensions >= self._lower):
            taut = context.get_time()
            state.set_value(self._taut, [taut])
        if np.isfinite(taut):
            state.set_value(self._lowest, np.minimum(tensions, seen.lowest))
        return EventStatus.Succeeded()


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
