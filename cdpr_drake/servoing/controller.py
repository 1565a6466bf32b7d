"""One step of a visual servo, from an image to a twist of the platform: any features, any law."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.servoing import servo_law
from cdpr_drake.servoing.packed_features_kernel import feature_kernel
from cdpr_drake.servoing.servo_law import ServoLaw
from cdpr_drake.servoing.servo_step_kernel import (
    look_and_step_at,
    servo_step,
    step_addresses,
    task_at,
)
from cdpr_drake.servoing.servo_task import INTERACTIONS, BelievedRobot, CameraMounting, ServoTask
from cdpr_drake.servoing.target_motion import MotionFilter, feature_drift
from cdpr_drake.servoing.visual_features import Sighting, columns, packed_sighting

MODE_ENTRIES = [servo_law.MODE, servo_law.SWITCHES, *range(servo_law.OF_POSE, servo_law.FEATURES)]
"""Where in a memory stands what `ServoController.mode` says."""


class Command(NamedTuple):
    """What a step asks for.

    Attributes:
        cable_velocities: Shape (m,) [m/s], positive pays out.
        V_P: Twist (w, v) of the platform in P, shape (6,) [rad/s, m/s].
        error: s - s*(t), shape (k,), as it is after the filter, where there is one.
        gain: lambda [1/s].
    """

    cable_velocities: Array
    V_P: Array
    error: Array
    gain: float


class ServoController:
    """A visual servo as a function of a sighting, the platform's pose and a memory.

    Where `sees_packed`, a step is one call of `servo_step_kernel.look_and_step_at`, which compiled
    loops call as `step_packed` does; features written in Python, plans and compensation keep their
    part in Python before `servo_step_kernel.servo_step`.

    The memory is one vector of `memory_size` numbers, so that it can be a discrete state; it
    begins as `fresh_memory()`.

    With a time constant T of the law's `smoothing` and steps of dt, e below is filtered: it begins
    as `s - s*` and goes from step to step by the share 1 - exp(-dt / T) of the way to it.

    With features s, their interaction matrix L, `s*(t)` from the task's plan, the estimated drift b
    of s by the object's motion, and `e = s - s*`, the camera's twist against the object is

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
            # Of a switching servo, see `servo_law.MODE`.
            "switch": servo_law.FEATURES - servo_law.SWITCH,
            "features": k,  # s of the step before
            "own_rate": k,  # L V_C of the step before
            "plan": 3,  # when the plan began, its t_full, waypoints passed before it
            "plan_start": k,  # its s_init
            "replans": 1,
            "first_way": 1,  # length of the first plan's path, for plans that follow
            "filter": 2 * k + 3,
            "smooth": 0 if law.smoothing is None else k,  # the filtered error
        }
        ends = np.cumsum(list(sizes.values()))
        self._at = {
            name: slice(int(end) - size, int(end))
            for (name, size), end in zip(sizes.items(), ends, strict=True)
        }
        self.memory_size = int(ends[-1])
        assert self._at["features"].start == servo_law.FEATURES
        self._motions = np.array(robot.motions)
        self._law = self._packed_law()
        self._begins = np.array([task.begins for task in self.tasks])
        packed = [task.features.packed() for task in self.tasks]
        self.sees_packed = all(
            features is not None and task.plan is None
            for features, task in zip(packed, self.tasks, strict=True)
        )
        if law.compensation is not None or law.smoothing is not None:
            self.sees_packed = False
        if self.sees_packed:
            X_mount = columns(robot.X_PC if X_PO is None else X_PO)
            self._steps = [
                step_addresses(
                    (feature_kernel(one.kernel), one.size, one.dropped, task.features.rank),
                    one.numbers,
                    self._law,
                    task.L_desired,
                    INTERACTIONS.index(task.interaction),
                    task.resting,
                    X_mount=X_mount,
                    cables=self._cable_rows,
                    motions=self._motions,
                )
                for one, task in zip(packed, self.tasks, strict=True)
                if one is not None
            ]

    def _packed_law(self) -> Array:
        """The law as `servo_step` takes it."""
        law, packed = self.law, np.full(servo_law.LAW_SIZE, np.nan)
        packed[servo_law.GAIN_AT_ZERO] = law.gain.at_zero
        packed[servo_law.GAIN_AT_INFINITY] = law.gain.at_infinity
        packed[servo_law.GAIN_SLOPE] = law.gain.slope
        if law.sigma is not None:
            packed[servo_law.SIGMA] = law.sigma
        if law.yaw is not None:
            packed[servo_law.YAW_GAIN], packed[servo_law.YAW_ANGLE] = law.yaw.gain, law.yaw.angle
        packed[servo_law.IN_BASE_FRAME] = float(law.frame == "base")
        packed[servo_law.CABLE_SPEED] = self.robot.cable_speed
        packed[servo_law.SIGN] = -1.0 if self.mounting.is_eye_to_hand() else 1.0
        packed[servo_law.KIND] = servo_law.WHOLE
        partition, switching = law.partition, law.switching
        if partition is not None:
            packed[servo_law.KIND] = servo_law.PARTITIONED
            packed[servo_law.AXIS_GAIN] = partition.axis_gain
            packed[servo_law.GOAL] = servo_law.GOALS.index(partition.goal)
            if partition.field is not None:
                packed[servo_law.EDGE_GAIN] = partition.field.gain
                packed[servo_law.EDGE_DISTANCE] = partition.field.distance
                packed[servo_law.X_LOWEST : servo_law.Y_HIGHEST + 1] = partition.field.edges
        elif switching is not None:
            packed[servo_law.KIND] = servo_law.SWITCHING
            packed[servo_law.FIRST_MODE] = servo_law.MODES.index(switching.first)
            bounds = (switching.pose_bound, switching.image_bound)
            packed[servo_law.POSE_BOUND : servo_law.IMAGE_BOUND + 1] = [
                np.nan if b is None else b for b in bounds
            ]
            packed[servo_law.BOUND_RATIO] = switching.bound_ratio
            packed[servo_law.DWELL] = switching.dwell
            packed[servo_law.AHEAD] = self._period
        return packed

    def believe(self, p_WA: Array, p_PB: Array) -> None:
        """Steps from here on go by other exit and anchor points, both shape (3, m) [m].

        The rest of the model, `robot` included, stays. It is a part of the controller and of no
        memory: who steps several memories says before each step which points it goes by.
        """
        self._cable_rows[:, :3] = p_WA.T
        self._cable_rows[:, 3:6] = p_PB.T

    def fresh_memory(self) -> Array:
        """Memory before the first step, shape (memory_size,)."""
        memory = np.zeros(self.memory_size)
        memory[self._at["begun"]] = -1.0
        memory[self._at["filter"]] = MotionFilter.start(self.size)
        return memory

    def lose(self, memory: Array) -> Array:
        """Memory after a step without the object: the platform rests, the task begins anew."""
        fresh = self.fresh_memory()
        fresh[self._at["task"]] = memory[self._at["task"]]
        fresh[servo_law.SWITCHES] = memory[servo_law.SWITCHES]
        return fresh

    def step(
        self, memory: Array, seen: Sighting, R_WP: Array, p_WP: Array, time: float
    ) -> tuple[Command, Array]:
        """One step; see the class.

        Args:
            memory: As `fresh_memory` or the step before left it; it is not changed.
            seen: What is seen.
            R_WP: Estimated rotation of the platform, shape (3, 3).
            p_WP: Its estimated position, shape (3,) [m].
            time: Time [s].
        """
        X_WP = np.empty(12)
        X_WP[:9].reshape(3, 3)[:] = R_WP.T
        X_WP[9:] = p_WP
        if self.sees_packed:
            return self.step_packed(memory, packed_sighting(seen), X_WP, time)
        memory = np.array(memory)
        task = self.tasks[task_at(self._begins, memory, time)]
        s, L = task.features.evaluate(seen)
        first = bool(memory[servo_law.BEGUN] < 0.0)
        reference = np.empty((3, self.size))
        reference[2] = self._drift(memory, s, first)
        reference[0], reference[1] = self._reference(memory, task, s, time, first)
        out = np.empty(self.cable_count + self.size + 7)
        taken = self._smoothed(memory, s, reference[0], first)
        servo_step(
            self._law, task.features.rank, taken, L, task.chosen_interaction(L), reference,
            columns(self.mounting.from_platform(seen)), X_WP, self._cable_rows, self._motions,
            time, memory, out,
        )  # fmt: skip
        memory[self._at["features"]] = s  # what was seen, also where something else was taken
        return self._command(out), memory

    def step_packed(
        self, memory: Array, seen: Array, X_WP: Array, time: float
    ) -> tuple[Command, Array]:
        """As `step`, for features that have kernels, without plan and compensation: one call.

        Args:
            memory: As in `step`.
            seen: What is seen, as `servoing.packed_features_kernel` says.
            X_WP: Estimated pose of the platform as `servoing.columns`, shape (12,) [-, m].
            time: Time [s].
        """
        memory = np.array(memory)
        number = task_at(self._begins, memory, time) if len(self.tasks) > 1 else 0
        out = np.empty(self.cable_count + self.size + 7)
        look_and_step_at(self._steps[number][0], seen, X_WP, time, memory, out)
        return self._command(out), memory

    def _command(self, out: Array) -> Command:
        m = self.cable_count
        return Command(out[:m], out[m : m + 6], out[m + 6 : -1], float(out[-1]))

    def _smoothed(self, memory: Array, s: Array, target: Array, first: bool) -> Array:
        """Features whose error from the target is the filtered one, shape (k,)."""
        if self.law.smoothing is None:
            return s
        at, error = self._at["smooth"], s - target
        share = 1.0 if first else -np.expm1(-self._period / self.law.smoothing)
        memory[at] += share * (error - memory[at])
        return np.asarray(target + memory[at])

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

    def mode(self, memory: Array) -> Array:
        """What a switching servo does: number in `MODES` of the features that act, switches since
        the run began, L_P and L_I of the last step and their bounds; shape (6,)."""
        return memory[MODE_ENTRIES]
