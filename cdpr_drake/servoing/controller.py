"""One step of a visual servo, from an image to a twist of the platform: any features, any law."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.features import Sighting
from cdpr_drake.geometry import (
    base_adjoint,
    cable_rates_from_base_twist,
    cable_rates_from_platform_twist,
)
from cdpr_drake.numerics import least_squares
from cdpr_drake.servoing.believed_robot import BelievedRobot
from cdpr_drake.servoing.camera_mounting import CameraMounting
from cdpr_drake.servoing.gain import AdaptiveGain, saturation_share
from cdpr_drake.servoing.target_motion import MotionFilter, feature_drift
from cdpr_drake.servoing.task import ServoTask
from cdpr_drake.spatial import adjoint_of_arrays

FRAMES = ("platform", "base")


@dataclass(frozen=True)
class YawTask:
    """A secondary task: turns the platform about the vertical as far as the features let it.

    Attributes:
        angle: Wanted yaw of the platform's x axis about z of W [rad].
        gain: [1/s].
    """

    angle: float
    gain: float


@dataclass(frozen=True)
class ServoLaw:
    """How a visual servo moves.

    Attributes:
        gain: Adaptive gain lambda [1/s].
        sigma: Rate at which the continuous start is forgotten [1/s]; None starts abruptly.
        compensation: Estimates the object's motion; None takes it to be at rest.
        yaw: Secondary task, for features that leave a motion free; None: the least motion.
        frame: Frame in which the twist becomes cable velocities, one of `FRAMES`.
    """

    gain: AdaptiveGain
    sigma: float | None = None
    compensation: MotionFilter | None = None
    yaw: YawTask | None = None
    frame: str = "platform"


@dataclass(frozen=True)
class Command:
    """What a step asks for.

    Attributes:
        cable_velocities: Shape (m,) [m/s], positive pays out.
        V_P: Twist (w, v) of the platform in P, shape (6,) [rad/s, m/s].
        error: s - s*(t), shape (k,).
        gain: lambda [1/s].
    """

    cable_velocities: Array
    V_P: Array
    error: Array
    gain: float


class ServoController:
    """A visual servo as a function of a sighting, the platform's pose and a memory.

    The memory is one vector of `memory_size` numbers, so that it can be a discrete state; it
    begins as `fresh_memory()`.

    With features s, their interaction matrix L, s*(t) from the task's plan, the estimated drift b
    of s by the object's motion, and e = s - s*, the camera's twist against the object is

        V_C = U + (V_0 - lambda U_0 / lambda_0) exp(-sigma t),
        U = L^+ (-lambda e + ds*/dt - b) + (1 - L^+ L) V_2,

    where U_0 and lambda_0 are those at the start of the task and V_0 is the twist before it, so
    that V_C is continuous there; V_2 belongs to the secondary task.

    Source: servoing thesis (1.31), (1.35), (1.39), (1.54), (4.2).
    """

    def __init__(
        self,
        law: ServoLaw,
        tasks: Sequence[ServoTask],
        robot: BelievedRobot,
        period: float,
        X_PO: RigidTransform | None = None,
    ) -> None:
        """A controller of one robot.

        Args:
            law: How it moves.
            tasks: What it is asked for, in the order of their times.
            robot: The robot as it is believed to be; its pulleys count where its cables have any.
            period: Time between steps [s].
            X_PO: Object on the platform, for a camera in the world (eye to hand); None: the camera
                is on the platform.
        """
        self.law, self.tasks, self.robot = law, tuple(tasks), robot
        self.mounting = CameraMounting(robot.X_PC, X_PO)
        self._cable_rows, self._period = robot.cables.packed(), period
        self.size, self.cable_count = len(tasks[0].final), robot.cables.count
        k = self.size
        sizes = {
            "begun": 1,  # when the task began; negative: it has not
            "task": 1,  # its number
            "twist": 6,  # V_C of the step before
            "before": 6,  # V_0
            "toward": 6,  # -U_0 / lambda_0
            "features": k,  # s of the step before
            "own_rate": k,  # L V_C of the step before
            "plan": 3,  # when the plan began, its t_full, waypoints passed before it
            "plan_start": k,  # its s_init
            "replans": 1,
            "first_way": 1,  # length of the first plan's path, for plans that follow
            "filter": 2 * k + 3,
        }
        ends = np.cumsum(list(sizes.values()))
        self._at = {
            name: slice(int(end) - size, int(end))
            for (name, size), end in zip(sizes.items(), ends, strict=True)
        }
        self.memory_size = int(ends[-1])
        motions = list(robot.motions)
        self._spatial = len(motions) == 6
        self._motions = motions

    def fresh_memory(self) -> Array:
        """Memory before the first step, shape (memory_size,)."""
        memory = np.zeros(self.memory_size)
        memory[self._at["begun"]] = -1.0
        memory[self._at["filter"]] = MotionFilter.start(self.size)
        return memory

    def lose(self, memory: Array) -> Array:
        """Memory after a step without the object: the platform rests, the task begins anew."""
        memory = np.array(memory)
        task = float(memory[self._at["task"]][0])
        memory = self.fresh_memory()
        memory[self._at["task"]] = task
        return memory

    def step(
        self, memory: Array, seen: Sighting, R_WP: Array, p_WP: Array, time: float
    ) -> tuple[Command, Array]:
        """One step, from what is seen and the estimated pose of the platform; see the class."""
        at, law = self._at, self.law
        memory = np.array(memory)
        task = self._current_task(memory, time)
        s, L_now = task.features.evaluate(seen)
        first = memory[at["begun"]][0] < 0.0
        drift = self._drift(memory, s, first)
        target, target_rate = self._reference(memory, task, s, time, first)
        e = s - target
        gain = law.gain(e)
        L = task.chosen_interaction(L_now)
        R_PC, p_PC, sign = self.mounting.from_platform(seen)
        if self._spatial:
            wanted, free = least_squares(L, -gain * e + target_rate - drift, task.features.rank)
        else:
            R_CP = np.ascontiguousarray(R_PC.T)
            basis = sign * adjoint_of_arrays(R_CP, -R_CP @ p_PC)[:, self._motions]
            motion, free = least_squares(L @ basis, -gain * e + target_rate - drift, 6)
            wanted = basis @ motion
        if law.yaw is not None and self._spatial:
            wanted = wanted + free @ self._yaw_twist(law.yaw, R_WP, R_PC, sign)
        V_C = self._continuous(memory, wanted, gain, time, first)
        rates, V_P = self._cables(V_C, R_PC, p_PC, sign, R_WP, p_WP)
        share = saturation_share(rates, self.robot.cable_speed)
        memory[at["twist"]] = share * V_C
        memory[at["features"]] = s
        memory[at["own_rate"]] = L_now @ (share * V_C)
        return Command(share * rates, share * V_P, e, gain), memory

    def _current_task(self, memory: Array, time: float) -> ServoTask:
        """The task of now; one that takes over begins anew, from the twist of the one before."""
        at = self._at
        number = int(memory[at["task"]][0])
        while number + 1 < len(self.tasks) and time >= self.tasks[number + 1].begins:
            number += 1
            memory[at["begun"]] = -1.0
            memory[at["before"]] = memory[at["twist"]]
        memory[at["task"]] = number
        return self.tasks[number]

    def _drift(self, memory: Array, s: Array, first: bool) -> Array:
        at, compensation = self._at, self.law.compensation
        if compensation is None or first:
            return np.zeros(self.size)
        measured = feature_drift(s, memory[at["features"]], memory[at["own_rate"]], self._period)
        estimate, memory[at["filter"]] = compensation.step(memory[at["filter"]], measured)
        return estimate

    def _reference(
        self, memory: Array, task: ServoTask, s: Array, time: float, first: bool
    ) -> tuple[Array, Array]:
        """s*(t) and its rate; plans, and plans again where the error leaves its bound."""
        plan, at = task.plan, self._at
        if plan is None:
            return task.final, np.zeros(self.size)
        if first:
            self._begin_plan(memory, s, time, plan.time_needed(s), 0)
            memory[at["first_way"]] = plan.way(s)
        began, t_full, passed = memory[at["plan"]]
        start = memory[at["plan_start"]]
        target, rate, passed_now = plan.at(start, t_full, time - began, int(passed))
        off = np.linalg.norm(s - target)
        if plan.replan_error is not None and off > plan.replan_error:
            t_full = plan.time_needed(s, passed_now)
            if plan.duration is not None:  # at the mean speed of the first plan
                first_way = float(memory[at["first_way"]][0])
                t_full *= plan.way(s, passed_now) / first_way if first_way > 0.0 else 1.0
            self._begin_plan(memory, s, time, t_full, passed_now)
            memory[at["replans"]] += 1.0
            target, rate, _ = plan.at(s, t_full, 0.0, passed_now)
        return target, rate

    def _begin_plan(self, memory: Array, s: Array, time: float, t_full: float, passed: int) -> None:
        memory[self._at["plan"]] = time, t_full, passed
        memory[self._at["plan_start"]] = s

    def replans(self, memory: Array) -> int:
        """How often the path was planned again since the task began."""
        return int(memory[self._at["replans"]][0])

    def _continuous(
        self, memory: Array, wanted: Array, gain: float, time: float, first: bool
    ) -> Array:
        at, sigma = self._at, self.law.sigma
        if first:
            memory[at["begun"]] = time
            memory[at["toward"]] = -wanted / gain
        if sigma is None:
            return wanted
        fading = math.exp(-sigma * (time - float(memory[at["begun"]][0])))
        if fading < 1e-12:
            return wanted
        return np.asarray(
            wanted + (memory[at["before"]] + gain * memory[at["toward"]]) * fading, float
        )

    @staticmethod
    def _yaw_twist(yaw: YawTask, R_WP: Array, R_PC: Array, sign: float) -> Array:
        """V_2: turns the platform about the vertical towards the wanted yaw."""
        angle = yaw.angle - np.arctan2(R_WP[1, 0], R_WP[0, 0])
        rate = yaw.gain * np.arctan2(np.sin(angle), np.cos(angle))
        twist = np.zeros(6)
        twist[:3] = sign * rate * (R_WP @ R_PC)[2]
        return twist

    def _cables(
        self, V_C: Array, R_PC: Array, p_PC: Array, sign: float, R_WP: Array, p_WP: Array
    ) -> tuple[Array, Array]:
        """Cable velocities [m/s] and the platform's twist in P, for the camera's twist in C."""
        if self.law.frame == "base":
            V_WP = sign * (base_adjoint(R_WP, R_PC, p_PC) @ V_C)
            rates = cable_rates_from_base_twist(R_WP, p_WP, self._cable_rows, V_WP)
            return rates, np.concatenate([R_WP.T @ V_WP[:3], R_WP.T @ V_WP[3:]])
        V_P = sign * (adjoint_of_arrays(R_PC, p_PC) @ V_C)
        if not self._spatial:
            kept = np.zeros(6)
            kept[self._motions] = V_P[self._motions]
            V_P = kept
        return cable_rates_from_platform_twist(R_WP, p_WP, self._cable_rows, V_P), V_P
