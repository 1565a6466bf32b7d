"""Rest to rest without swing by multiple shooting through the compiled engine.

Direct collocation approximates the motion between its points by polynomials, and fails where cables
are stiff: a polynomial is no vibration of a hundred hertz, unless its points are a millisecond
apart. Here the motion between a few instants is what the compiled engine says it is, with the steps
of the simulation, so that stiff cables make steps short and the program no larger. Unknown are the
states at these instants and a correction of the unstrained lengths, cubic splines of time that
begin and end with zero in value and velocity. Of all corrections that end at rest the least one is
taken, by the integral of its squared accelerations. Each step of the search linearises the motion
between two instants by differences, eliminates the states, and solves for the correction.

Source: Bock and Plitt, A multiple shooting algorithm for direct solution of optimal control
problems, 1984.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from pydrake.math import RigidTransform
from scipy.interpolate import BSpline

from cdpr_drake.analyses.planning.input_shaping import (
    PERIOD,
    STEP,
    ShapedRest,
    check_speeds,
    plan_shaped_rest,
    rests_on,
)
from cdpr_drake.arrays import Array
from cdpr_drake.dynamics.advance_events_kernel import (
    fresh_memory,
    integrate_explicit_along,
    robot_addresses,
)
from cdpr_drake.dynamics.advance_kernel import REPORTED
from cdpr_drake.dynamics.robot_arrays import Drive
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import rotation_from_vector, rotation_vector
from cdpr_drake.models.robot_in_plant import pose_on_joint
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import (
    PackedRule,
    StepRule,
    motion_problem,
    resting_state,
)
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings

SEGMENTS = 4  # parts of the motion that are shot one by one
SPLINES = 12  # splines of the correction of each cable

DEGREE = 3

MOST_ROUNDS = 15

REACHED = 1e-9  # places, and ways in a period of the slowest vibration, that ends may differ by [m]

SMALL = 1e-6
"""Differences by which the motion is linearised: of states, as `_Shooter.scale` has them, and of
lengths [m]."""

RANK = 1e-9
"""Of what corrections can do, less than this share is nothing, as in directions of symmetry."""


def plan_shot_rest(
    robot: Robot, start: RigidTransform, goal: RigidTransform, duration: float, *,
    cables: CableSettings | None = None, bounds: tuple[float, float] | None = None,
    ratios: Sequence[float] = (1.0,),
) -> ShapedRest:  # fmt: skip
    """Plans a motion that ends at rest, in the time of a quintic law and not longer.

    Args:
        robot: As of `plan_shaped_rest`.
        start: As there [m].
        goal: As there [m].
        duration: Of the whole motion, above 0 [s].
        cables: As there.
        bounds: As there [N].
        ratios: The same commands end at rest on cables of so many times their stiffness; several
            make a motion that minds a wrong stiffness less, and takes larger corrections.

    Raises:
        PlanningError: As `plan_shaped_rest`; a cable gets slack on the way, or the search ends
            before the platform rests; says how near it came.
        InfeasibleTensionError: No tensions within the bounds hold a pose on the way.
        EquilibriumError: No pose of rest is found near a pose.
    """
    plain = plan_shaped_rest(robot, start, goal, duration, None, cables=cables, bounds=bounds)
    shooters = [_Shooter(plain, ratio) for ratio in ratios]
    c, R = np.zeros((SPLINES, len(robot.cables))), _splines(duration)[1]
    nodes = [shooter.nodes(c) for shooter in shooters]
    missed, gaps = _missed(shooters, c, nodes)
    for _ in range(MOST_ROUNDS):
        if missed <= REACHED:
            break
        linear = [s.linear(c, x, g) for s, x, g in zip(shooters, nodes, gaps, strict=True)]
        y = _least(R, c, [chain[-1] for chain in linear])
        for share in (1.0, 0.5, 0.25, 0.1):
            c_next = c + share * (y - c)
            moved = [
                [shooter.moved(x, share * (M @ (y - c).ravel() + g))
                 for x, (M, g) in zip(mine, chain[:-1], strict=True)]
                for shooter, mine, chain in zip(shooters, nodes, linear, strict=True)
            ]  # fmt: skip
            nearer, gaps_next = _missed(shooters, c_next, moved)
            if nearer < missed:
                break
        else:
            break  # as near as differences lead
        c, nodes, missed, gaps = c_next, moved, nearer, gaps_next
    for shooter, mine in zip(shooters, nodes, strict=True):
        shooter.check_taut(c, mine)
    if missed > REACHED:
        raise PlanningError(
            f"duration: found {duration:g} s, in which no correction of lengths was found that "
            f"leaves {robot.name} at rest; it came within {missed:.2g} m; accepted: more"
        )
    motion = replace(plain, correction=shooters[0].spline(c))
    check_speeds(motion)
    return motion


def _missed(
    shooters: Sequence[_Shooter], c: Array, nodes: Sequence[list[Array]]
) -> tuple[float, list[list[Array]]]:
    """The largest gap of all, and the gaps of each [m]."""
    gaps = [shooter.gaps(c, mine) for shooter, mine in zip(shooters, nodes, strict=True)]
    return float(np.max(np.abs(gaps))), gaps


def _least(R: Array, c: Array, ends: Sequence[tuple[Array, Array]]) -> Array:
    """The correction of the least y' R y of which all linearised motions end at rest, as c."""
    reach, gap = (np.concatenate(part) for part in zip(*ends, strict=True))
    cost = np.kron(np.linalg.inv(R), np.eye(c.shape[1]))
    target = reach @ c.ravel() - gap
    y = cost @ reach.T @ np.linalg.lstsq(reach @ cost @ reach.T, target, rcond=RANK)[0]
    return np.asarray(y.reshape(c.shape))


@dataclass(frozen=True)
class _Segment:
    """One part of a motion: its instants, and which splines act in it."""

    times: Array
    active: list[int]


class _Shooter:
    """Motions of a robot between instants, as functions of states and of a correction."""

    def __init__(self, plain: ShapedRest, ratio: float) -> None:
        """For cables of so many times the stiffness of those of a motion."""
        robot, cables = plain.robot, plain.cables
        if robot.contact_hysteresis() is not None:
            raise PlanningError(
                f"platform.hysteresis of {robot.name}: found a section; accepted by a motion from "
                "rest to rest: null, since such a platform does not rest at one pose"
            )
        self.plain, self.m = plain, len(robot.cables)
        self._knots, _ = _splines(plain.duration)
        settings = replace(cables, stiffness_ratio=ratio * cables.stiffness_ratio)
        self._cables = settings.cable_set(robot)
        block = CompiledCableRobot(robot, CableRobotSettings(cables=settings))
        self._block, self._joint = block.motion, robot.joint()
        self._arrays = block.motion.arrays()
        self._where = robot_addresses(self._arrays)
        self._rule = PackedRule(StepRule(method="runge_kutta3", max_step=STEP))
        self._n, self._nv = self._joint.num_states, self._joint.num_velocities
        size = self._n + self.m
        self._memory = fresh_memory(size, self.m)
        self._present = np.zeros(size + 1 + REPORTED)
        count = int(np.ceil(plain.duration / PERIOD))
        times = np.asarray(np.arange(count + 1) * PERIOD, dtype=np.float64)
        cuts = np.unique(np.round(np.linspace(0, count, SEGMENTS + 1)).astype(int))
        self.segments = [self._segment(times[a : b + 1]) for a, b in pairwise(cuts.tolist())]
        slowest = 2.0 * np.pi * float(np.min(plain.frequencies))
        arm = float(np.sqrt(np.mean(np.sum(robot.cable_set().p_PB ** 2, axis=0)))) or 1.0
        if self._joint.is_floating:
            place = np.array([1.0 / arm] * 3 + [1.0] * 3)
        else:
            place = np.array([1.0, 1.0, 1.0 / arm])[: self._nv]
        # A state's small steps as ways [m]; velocities by what they make of a vibration.
        self.scale = np.concatenate([place, place * slowest])
        rests = (plain.start, plain.goal) if ratio == 1.0 else rests_on(plain, settings)
        self._start, self._goal = (self._rest(rest.X_WP) for rest in rests)

    def _segment(self, times: Array) -> _Segment:
        # The first and last two splines are zero.
        ends = [(self._knots[i], self._knots[i + DEGREE + 1]) for i in range(2, SPLINES + 2)]
        return _Segment(
            times, [i for i, (a, b) in enumerate(ends) if a < times[-1] and b > times[0]]
        )

    def _rest(self, X_WP: RigidTransform) -> Array:
        """State of the platform at rest at a pose, shape (n,)."""
        still = np.zeros(self.m)
        state = resting_state(self.plain.robot, Drive(), X_WP, still, still, home=still)
        return state[: self._n]

    def spline(self, c: Array) -> BSpline:
        """The correction with coefficients of shape (splines, m) [m]."""
        zero = np.zeros((2, self.m))
        return BSpline(self._knots, np.vstack([zero, c, zero]), DEGREE)

    def lengths(self, c: Array, times: Array) -> Array:
        """Unstrained lengths at times, shape (n, m) [m]."""
        return replace(self.plain, correction=self.spline(c)).lengths_at(times)

    def moved(self, state: Array, step: Array) -> Array:
        """A state of the platform after a small step, shape (2 nv,) [m], as `scale` has it."""
        new, by, nv = state.copy(), step * self.scale, self._nv
        if self._joint.is_floating:
            X = pose_on_joint(self._joint, state)
            R = rotation_from_vector(by[:3]) @ X.rotation()
            q = R.ToQuaternion().wxyz()
            new[:4] = q if q @ state[:4] > 0.0 else -q
            new[4:7] += by[3:6]
        else:
            new[: self._n - nv] += by[:nv]
        new[self._n - nv :] += by[nv:]
        return new

    def apart(self, first: Array, second: Array) -> Array:
        """The step from a state to another one, shape (2 nv,) [m]."""
        size, step = self._n - self._nv, second - first
        place = step[:size]
        if self._joint.is_floating:
            X, Y = (pose_on_joint(self._joint, state) for state in (first, second))
            turn = rotation_vector(Y.rotation() @ X.rotation().inverse())
            place = np.concatenate([turn, step[4:7]])
        return np.concatenate([place, step[size:]]) / self.scale

    def shot(
        self, state: Array, c: Array, segment: _Segment,
        looks: list[tuple[float, Array]] | None = None,
    ) -> Array:  # fmt: skip
        """State of the platform at the end of a segment from one at its beginning, shape (n,).

        Times and states of the instants between are added to `looks`.

        Raises:
            CableGeometryError: A cable cannot run.
            DivergedError: Numbers are not finite any more.
        """
        n, times = self._n, segment.times
        l0 = self.lengths(c, times)
        present, memory, others = self._present, self._memory, np.zeros((2, self.m))
        present[:n], present[n : n + self.m], present[n + self.m :] = state, l0[0], 0.0
        present[n + self.m] = times[0]
        commands = np.diff(l0, axis=0) / np.diff(times)[:, np.newaxis]
        reached = np.empty((len(commands), len(present)))
        bad = integrate_explicit_along(
            self._where, self._rule.numbers, present, commands, others, times, memory, reached
        )
        if bad != INTEGRATION_OK:
            failed = int(np.searchsorted(times, present[n + self.m])) + 1
            raise motion_problem(
                self.plain.robot, self._cables, self._rule.rule, bad, present,
                time=float(times[failed]),
            )  # fmt: skip
        if looks is not None:
            looks += zip(times[1:].tolist(), reached[:, :n], strict=True)
        return present[:n].copy()

    def nodes(self, c: Array) -> list[Array]:
        """States at the beginnings of all segments, shot one after the other."""
        states = [self._start]
        for segment in self.segments[:-1]:
            states.append(self.shot(states[-1], c, segment))
        return states

    def gaps(self, c: Array, nodes: list[Array]) -> list[Array]:
        """Of the ends of segments from what follows, one of shape (2 nv,) each [m]."""
        after = [*nodes[1:], self._goal]
        return [
            self.apart(after[k], self.shot(nodes[k], c, segment))
            for k, segment in enumerate(self.segments)
        ]

    def linear(self, c: Array, nodes: list[Array], gaps: list[Array]) -> list[tuple[Array, Array]]:
        """How nodes and end follow a change of the correction once all gaps are closed.

        Of each, the last one of the end: slopes, shape (2 nv, splines m), and what it is without
        any change, shape (2 nv,) [m].
        """
        size = 2 * self._nv
        reach, gap = np.zeros((size, c.size)), np.zeros(size)
        chain = [(reach, gap)]
        for k, segment in enumerate(self.segments):
            A, B = self._slopes(nodes[k], c, segment)
            reach, gap = A @ reach + B, A @ gap + gaps[k]
            chain.append((reach, gap))
        return chain

    def _slopes(self, state: Array, c: Array, segment: _Segment) -> tuple[Array, Array]:
        """How the end of a segment follows its beginning and the correction, by differences."""
        size = 2 * self._nv
        end = self.shot(state, c, segment)
        A, B = np.empty((size, size)), np.zeros((size, *c.shape))
        for i, e in enumerate(np.eye(size)):
            ahead, behind = (
                self.shot(self.moved(state, h * e), c, segment) for h in (SMALL, -SMALL)
            )
            A[:, i] = (self.apart(end, ahead) - self.apart(end, behind)) / (2.0 * SMALL)
        for i in segment.active:
            for j in range(self.m):
                ends = []
                for h in (SMALL, -SMALL):
                    changed = c.copy()
                    changed[i, j] += h
                    ends.append(self.apart(end, self.shot(state, changed, segment)))
                B[:, i, j] = (ends[0] - ends[1]) / (2.0 * SMALL)
        return A, B.reshape(size, -1)

    def check_taut(self, c: Array, nodes: list[Array]) -> None:
        """Raises a PlanningError where a cable gets slack on the way."""
        looks: list[tuple[float, Array]] = []
        for state, segment in zip(nodes, self.segments, strict=True):
            self.shot(state, c, segment, looks)
        for time, state in looks:
            lengths = cable_paths(pose_on_joint(self._joint, state), self._cables).lengths
            left = lengths - self.lengths(c, np.array([time]))[0]
            if np.min(left) < 0.0:
                name = self.plain.robot.cables[int(np.argmin(left))].name
                raise PlanningError(
                    f"duration: found {self.plain.duration:g} s, in which {name} gets slack at "
                    f"{time:.4g} s; accepted: more, or larger tensions on the way"
                )


def _splines(duration: float) -> tuple[Array, Array]:
    """Splines that begin and end with zero in value and velocity, and their cost.

    Returns:
        Their knots [s], and the integrals of products of their second derivatives, shape
        (splines, splines) [1/s^3].
    """
    whole = SPLINES + 4
    inner = np.linspace(0.0, duration, whole - DEGREE + 1)
    knots = np.concatenate([np.zeros(DEGREE), inner, np.full(DEGREE, duration)])
    points, weights = np.polynomial.legendre.leggauss(2)  # exact: piecewise linear, squared
    half = 0.5 * np.diff(inner)[:, np.newaxis]
    t = (0.5 * (inner[1:] + inner[:-1])[:, np.newaxis] + half * points).ravel()
    second = np.array(
        [BSpline(knots, np.eye(whole)[i], DEGREE).derivative(2)(t) for i in range(2, whole - 2)]
    )
    R = second * (half * weights).ravel() @ second.T
    return knots, R
