"""What the compiled motion of a robot is made of: rule, memory, state at rest, what went wrong."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialAcceleration, SpatialVelocity
from pydrake.systems.framework import Context, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.cables.behaving_kernel import put_crept
from cdpr_drake.cables.broken_cables import break_cables
from cdpr_drake.cables.simulation_kernel import guesses_of, make_room, model_force_and_drums
from cdpr_drake.dynamics.advance_events_kernel import integrate_explicit, integrate_semi_implicit
from cdpr_drake.dynamics.contact_kernel import CONTACTS, rub
from cdpr_drake.dynamics.explicit_kernel import METHODS
from cdpr_drake.dynamics.platform_kernel import floating_rates, line_rates, planar_rates
from cdpr_drake.dynamics.robot_arrays import (
    CREEPING,
    IDEAL,
    MOTORS,
    PLATFORM,
    RUB,
    RUBBING,
    SPEEDS,
    Drive,
    RobotArrays,
    apply_wrench,
)
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_DIVERGED
from cdpr_drake.errors import CableGeometryError, CdprError, DivergedError
from cdpr_drake.geometry.cable_paths import cable_paths, impossible_cable
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.platform_joint import PlatformJoint
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_in_plant import pose_from_state
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.robots.cable_forces import CREPT
from cdpr_drake.systems.robots.failures import BROKEN
from cdpr_drake.systems.robots.platform_hysteresis import BENT
from cdpr_drake.systems.robots.platform_wrench import APPLIED_WRENCH
from cdpr_drake.winches.motor import MODES, resting_motors


@dataclass(frozen=True, kw_only=True)
class StepRule:
    """How a compiled robot is integrated.

    Attributes:
        method: A name of `dynamics.METHODS`.
        max_step: Largest step [s].
        accuracy: Largest estimated error of a step in position [m] and rotation [rad]; steps are
            halved to keep it. None: steps are as long as `max_step` whatever their error.
    """

    method: str = "runge_kutta3"
    max_step: float = 1e-4
    accuracy: float | None = None


class PackedRule:
    """A `StepRule` as the kernels take it.

    Attributes:
        rule: The rule.
        reach: The kernel that goes by its method.
        numbers: Its numbers for that.
    """

    def __init__(self, rule: StepRule) -> None:
        self.rule = rule
        self.reach = (
            integrate_semi_implicit if rule.method == "semi_implicit" else integrate_explicit
        )
        bound = np.inf if rule.accuracy is None else rule.accuracy
        self.numbers = np.array([float(METHODS[rule.method]), rule.max_step, bound])


def packed_rule(rule: StepRule, drive: Drive) -> PackedRule:
    """A rule as the kernels take it, for what drives the cables.

    Raises:
        CdprError: Motors with several cables each by the semi-implicit method, whose matrix takes
            each motor to answer to one cable.
    """
    shared = drive.kind == MOTORS and drive.groups is not None and drive.groups.are_shared()
    if shared and rule.method == "semi_implicit":
        raise CdprError(
            "integrator: found semi_implicit for motors with several cables on one winch; "
            "accepted: runge_kutta3, runge_kutta2, or ideal winches"
        )
    return PackedRule(rule)


def resting_state(
    robot: Robot,
    drive: Drive,
    X_WP: RigidTransform,
    lengths: Array,
    tensions: Array,
    *,
    home: Array,
) -> Array:
    """State of platform and winches at rest, shape (n,).

    Args:
        robot: The robot; what its joint cannot do is left out.
        drive: What drives its cables.
        X_WP: Pose of the platform [m].
        lengths: Unstrained lengths, shape (m,) [m]; not read where tensions are commanded.
        tensions: At the drums, which motors hold, shape (m,) [N]; read with motors only.
        home: Unstrained lengths where the motors' angles are zero, shape (m,) [m].
    """
    joint = robot.joint()
    places = pose_row(X_WP) if joint.is_floating else joint.coordinates(X_WP)
    platform = np.concatenate([places, np.zeros(joint.num_velocities)])
    winch: Any = np.zeros(0)
    if drive.kind == IDEAL:
        winch = lengths
    elif drive.kind == MOTORS:
        assert drive.law is not None
        winch = resting_motors(drive.law, MODES[drive.mode], home, lengths, tensions)
    return np.concatenate([platform, winch])


def motion_problem(
    robot: Robot, cables: CableSet, rule: StepRule, bad: int, state: Array, *, time: float
) -> Exception:
    """What to raise after a step that failed.

    Args:
        robot: The robot.
        cables: Its cables.
        rule: How it was integrated.
        bad: What `advance_kernel.advance_robot` returned.
        state: The last good state, shape (n,).
        time: To when it was to be advanced [s].
    """
    if bad == INTEGRATION_DIVERGED:
        return DivergedError(
            f"before {time:g} s: the motion is not finite any more, by {rule.method} with "
            f"steps of {rule.max_step:g} s; shorter ones may help"
        )
    X_WP = pose_from_state(robot, state)
    try:
        cable_paths(X_WP, cables)
        cause = impossible_cable(X_WP, cables)
    except CableGeometryError as problem:
        cause = str(problem)
    return CableGeometryError(f"before {time:g} s: {cause}")


class CompiledBodies(LeafSystem):
    """What MultibodyPlant says of its bodies' motion, for a robot whose motion is compiled.

    ======================= ========================= ======= ===================================
    port                    type                      unit    meaning
    ======================= ========================= ======= ===================================
    platform_state          vector(13, 6 or 2)        m       in
    unstrained_lengths      vector(m)                 m       in
    unstrained_length_rates vector(m)                 m/s     in
    applied_wrench          vector(6)                 N m, N  in, may stay open
    broken                  vector(m)                 -       in, may stay open
    crept                   vector(m)                 -       in, of cables that creep only
    bent                    vector(3 or 1)            rad     in, of platforms that rub only
    body_velocities         list[SpatialVelocity]     rad/s   out, of the world and the platform, in
                                                      m/s     W, of the body's origin
    body_accelerations      list[SpatialAcceleration] rad/s^2 out, the same of accelerations
                                                      m/s^2
    ======================= ========================= ======= ===================================

    It has no state, and computes when it is asked.
    """

    def __init__(self, arrays: RobotArrays, law: int, joint: PlatformJoint) -> None:
        """With a robot as the kernels take it, by that joint; it is copied."""
        super().__init__()
        m, self._n = len(arrays.cables), int(arrays.kinds[PLATFORM])
        self._nv = int(arrays.kinds[SPEEDS])
        self._arrays = arrays._replace(body=arrays.body.copy())
        self._whole, self._joint = arrays.cables.copy(), joint
        self._cables = self._whole.copy()
        self._room = make_room(m, law, joint.height)
        self._R_WF = joint.X_WF.rotation().matrix()
        self._as_world = joint.is_as_world()
        self._inputs = [
            self.DeclareVectorInputPort(name, size)
            for name, size in (
                ("platform_state", self._n),
                ("unstrained_lengths", m),
                ("unstrained_length_rates", m),
            )
        ]
        self._crept = None
        if arrays.kinds[CREEPING] > 0:
            self._crept = self.DeclareVectorInputPort(CREPT, m)
        self._bent = None
        if arrays.kinds[RUBBING] > 0:
            self._bent = self.DeclareVectorInputPort(BENT, arrays.kinds[RUBBING])
        self._wrench = self.DeclareVectorInputPort(APPLIED_WRENCH, 6)
        self._broken = self.DeclareVectorInputPort(BROKEN, m)
        self.DeclareAbstractOutputPort(
            "body_velocities", lambda: Value[list[SpatialVelocity]](), self._calc_velocities
        )
        self.DeclareAbstractOutputPort(
            "body_accelerations", lambda: Value[list[SpatialAcceleration]](), self._calc
        )

    def _calc_velocities(self, context: Context, output: AbstractValue) -> None:
        w, v = self._parts(self._inputs[0].Eval(context)[-self._nv :])
        output.set_value([SpatialVelocity.Zero(), SpatialVelocity(w=w, v=v)])

    def _calc(self, context: Context, output: AbstractValue) -> None:
        state, lengths, rates = (port.Eval(context) for port in self._inputs)
        force, out = np.zeros(self._nv + len(self._cables)), np.zeros(self._n)
        if self._broken.HasValue(context):
            break_cables(self._whole, self._broken.Eval(context), self._cables)
        if self._crept is not None:
            put_crept(self._crept.Eval(context), guesses_of(self._room, len(self._cables)))
        model_force_and_drums(state, lengths, rates, self._cables, self._room, self._nv, force)
        if self._bent is not None:
            bent = self._bent.Eval(context)
            rub(state, bent, self._arrays.body[RUB : RUB + CONTACTS], force, np.empty(len(bent)))
        pushed = self._wrench.HasValue(context)
        apply_wrench(self._arrays, self._joint, self._wrench.Eval(context) if pushed else None)
        _RATES[self._n](state, force, self._arrays.body, out)
        alpha, a = self._parts(out[-self._nv :])
        output.set_value([SpatialAcceleration.Zero(), SpatialAcceleration(alpha=alpha, a=a)])

    def _parts(self, speeds: Array) -> tuple[Array, Array]:
        """Rotation and translation, in W, of generalized velocities or their rates."""
        if self._n == 13:
            return speeds[:3], speeds[3:]
        x, y, turn = speeds if self._n == 6 else (speeds[0], 0.0, 0.0)
        w, v = np.array([0.0, 0.0, turn]), np.array([x, y, 0.0])
        return (w, v) if self._as_world else (self._R_WF @ w, self._R_WF @ v)


_RATES = {13: floating_rates, 6: planar_rates, 2: line_rates}
"""Rates of a platform by the size of its state."""
