"""The block that reacts to broken cables."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from cdpr_drake.geometry.poses import pose_from_row, pose_row
from cdpr_drake.systems.controllers.break_reactions import (
    BRAKE,
    DESCEND,
    HOLD,
    RETREAT,
    STOP,
    ReactionRule,
    WaysOut,
    descent_twist,
    retreat_twist,
)


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

    def __init__(self, rule: ReactionRule, cables: int, ways: WaysOut | None = None) -> None:
        """With a rule and m cables, each on a winch of its own; `ways` for reactions that move the
        platform."""
        super().__init__()
        self._rule, m = rule, cables
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
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rule.rate, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        m, time, rule = self._m, context.get_time(), self._rule
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
