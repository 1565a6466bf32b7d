"""What a servo's loop hands to `servo_events_kernel`, and what it gets back."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.cables.simulation_kernel import OUTPUTS
from cdpr_drake.geometry.drake_pose_kernel import agrees
from cdpr_drake.numerics.kernel_calls import array_addresses, kernel_address
from cdpr_drake.numerics.normal_numbers_kernel import seed_words
from cdpr_drake.servoing.controller import MODE_ENTRIES
from cdpr_drake.servoing.servo_step_kernel import look_and_step_at
from cdpr_drake.servoing.visual_features import columns
from cdpr_drake.systems.controllers.feature_servo import MODE_PORT, FeatureServo
from cdpr_drake.systems.diagrams.servo_models import ServoModel
from cdpr_drake.systems.loops import servo_events_kernel as kernel
from cdpr_drake.systems.loops.loop_log import LoopLog
from cdpr_drake.systems.loops.robot_motion import RobotMotion
from cdpr_drake.systems.monitoring.run_monitor import RunMonitor
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.dots import DotTarget
from cdpr_drake.vision.planar_pose_kernel import planar_pose
from cdpr_drake.vision.target import PointTarget, Target

KINDS = {
    "control_integration": kernel.INTEGRATION,
    "consecutive_images": kernel.CONSECUTIVE,
    "first_image": kernel.FIRST,
}
"""Estimators that the kernel has, by their names in `ESTIMATORS`."""


def python_reason(scenario: Scenario, model: ServoModel) -> str:
    """Why a loop goes from event to event in Python, in one phrase; empty where its kernel does.

    Args:
        scenario: A scenario that a loop can do, see `diagram_reason`.
        model: What its servo is about.
    """
    camera, target = scenario.camera, model.target
    others = [
        kind for kind in (scenario.estimator.kind, *scenario.estimator.compare) if kind not in KINDS
    ]
    reasons = {
        "it follows a plan": model.plan is not None or scenario.pose_plan is not None,
        "its tensions are managed": scenario.tension_management is not None,
        "its cables creep": model.robot.cable_behaviour().creep_stiffness > 0.0,
        "its platform rubs as it turns": model.robot.contact_hysteresis() is not None,
        "its winches have motors": scenario.winches.has_motors(),
        "its sensors are logged": bool(scenario.sensors.log),
        f"its estimator is {', '.join(others)}": bool(others),
        "its estimate begins anew at a known tag": scenario.estimator.known_tag is not None,
        "its target moves": model.motion.is_moving(),
        "its law or its features have a part in Python": not model.controller.sees_packed,
        "its platform is no floating body": not model.robot.joint().is_floating,
        "its camera has a lens": not model.pinhole.is_ideal,
        "the focus of its camera changes": camera.focus_zoom > 0.0,
        "its camera fails": camera.fault is not None,
        "its target is no plane of points": not _is_plane(target),
        "this processor rounds poses in another way": not agrees(),
    }
    return next((reason for reason, holds in reasons.items() if holds), "")


def _is_plane(target: Target) -> bool:
    kind = type(target)
    same = all(
        getattr(kind, name) is getattr(PointTarget, name)
        for name in ("project", "solve", "write_normalized", "complete")
    )
    return (
        same
        and isinstance(target, PointTarget)
        and not target.quality
        and target.points.shape[1] >= 4
        and not target.points[2].any()
        and kind.center in (Target.center, TagTarget.center, DotTarget.center)
    )


@dataclass
class ServoState:
    """Where a loop stands, but for its robot and its log.

    Attributes:
        clocks: Period [s], next time [s] and whether it strikes now, of control, log and images.
        run: Time, since when the pose is reached, the target lost [s], judgement, outcome.
        frames: The camera's delay line.
        estimates: Memories of the estimators.
        servo: The servo's memory.
        outputs: The servo's outputs, by their names.
    """

    clocks: Array
    run: Array
    frames: Array
    estimates: list[Array]
    servo: Array
    outputs: dict[str, Array]


class ServoEvents:
    """A loop's arrays, and the kernel that goes on with them."""

    def __init__(
        self,
        scenario: Scenario,
        model: ServoModel,
        servo: FeatureServo,
        monitor: RunMonitor,
        motion: RobotMotion,
        *,
        offsets: Array | None,
        log: LoopLog,
        state: ServoState,
    ) -> None:
        """Of a loop for which `python_reason` is empty, where it stands; the robot's state and the
        log are written in their own arrays."""
        self._motion, self._log = motion, log
        arrays, controller, target = motion.kernel_arrays(), model.controller, model.target
        self._controller = controller  # its tables are addresses
        features, m = controller.tasks[0].features, controller.cable_count
        switches = MODE_PORT in state.outputs
        self._named = {
            "cable_velocities": slice(0, m),
            "platform_velocity": slice(m, m + 6),
            "error": slice(m + 6, m + 6 + controller.size),
            "gain": slice(m + 6 + controller.size, m + 7 + controller.size),
        }
        fresh = controller.fresh_memory()
        rules, bias = monitor.rules, scenario.perturbations.image_bias
        whole = np.zeros(kernel.ROOM_FOR + 1, dtype=np.int64)
        whole[: kernel.USES_MARKS + 1] = [
            kernel_address(arrays.reach, kernel.REACH_TYPES),
            kernel_address(arrays.outputs, kernel.OUTPUTS_TYPES),
            kernel_address(planar_pose, kernel.POSE_TYPES),
            kernel_address(look_and_step_at, kernel.STEP_TYPES),
            arrays.platform, len(arrays.present), model.mounting.is_eye_to_hand(),
            features.uses_center, type(target).center is not Target.center, features.uses_marks,
        ]  # fmt: skip
        whole[kernel.FEATURES], whole[kernel.SIZE] = controller.size, target.size
        numbers = [
            state.clocks[kernel.CONTROL, 0], scenario.camera.rate, scenario.camera.pixel_noise,
            rules.position, rules.rotation, rules.hold, rules.lost, monitor.earliest,
            monitor.free_rotation, *rules.lower, *rules.upper,
        ]  # fmt: skip
        mounting, X_PC = model.mounting, model.believed.X_PC
        fixed = [
            mounting.X_BC, mounting.X_BC.inverse(), mounting.X_PO or model.motion.at(0.0),
            X_PC, X_PC.inverse(), monitor.X_CdO,
        ]  # fmt: skip
        kinds = (scenario.estimator.kind, *scenario.estimator.compare)
        assert isinstance(target, PointTarget)
        self._arrays: list[Any] = [
            whole, _floats(numbers), np.zeros((3, 3)), np.zeros(5), arrays.limit,
            seed_words(scenario.seed), self._columns(target, scenario.estimator.compare, switches),
            arrays.robot, arrays.rule, arrays.present, arrays.command, arrays.calm, arrays.memory,
            arrays.cables, arrays.room, np.zeros((OUTPUTS, m)),
            _floats(target.points), _floats(target.outline), model.pinhole.numbers,
            _floats([] if bias is None else bias), np.array([columns(X) for X in fixed]),
            np.zeros(len(state.frames)), np.array([KINDS[kind] for kind in kinds], dtype=np.int64),
            np.zeros((len(kinds), max(len(one) for one in state.estimates))),
            controller.task_begins(), np.zeros(len(fresh)),
            np.concatenate([fresh, state.outputs.get(MODE_PORT, [])]),
            np.zeros(m + 7 + controller.size),
            np.array(MODE_ENTRIES if switches else [], dtype=np.int64),
            _floats([] if offsets is None else offsets), *log.make_room(0),
        ]  # fmt: skip
        self._whole, self._run = whole, self._arrays[kernel.RUN]
        self._robot, self._steps = arrays.robot, controller.step_tables()
        self._sizes = [len(one) for one in state.estimates]
        self._rate = scenario.log_rate
        self._table = array_addresses(self._arrays)
        self.load(state)

    def _columns(self, target: PointTarget, compare: Sequence[str], switches: bool) -> np.ndarray:
        names = [
            "X_WP", "X_CO_measured", "found", f"{target.mark}_px", "error", "gain",
            "platform_velocity", "cable_velocities", MODE_PORT if switches else "gain", "tensions",
            "unstrained_lengths", "X_WP_estimated", *(f"X_WP_{name}" for name in compare),
        ]  # fmt: skip
        return np.array([self._log.columns[name].start for name in names], dtype=np.int64)

    def load(self, state: ServoState) -> None:
        """Stands where a loop does."""
        arrays = self._arrays
        arrays[kernel.CLOCKS][:], arrays[kernel.RUN][:] = state.clocks, state.run
        arrays[kernel.FRAMES][:], arrays[kernel.SERVO][:] = state.frames, state.servo
        for row, memory in zip(arrays[kernel.ESTIMATES], state.estimates, strict=True):
            row[: len(memory)] = memory
        for name, where in self._named.items():
            arrays[kernel.RESULT][where] = state.outputs[name]
        if MODE_PORT in state.outputs:
            arrays[kernel.FRESH][len(state.servo) :] = state.outputs[MODE_PORT]

    def state(self) -> ServoState:
        """Copies of where it stands."""
        arrays = self._arrays
        outputs = {name: arrays[kernel.RESULT][where].copy() for name, where in self._named.items()}
        if len(arrays[kernel.MODES]):
            outputs[MODE_PORT] = arrays[kernel.FRESH][len(arrays[kernel.SERVO]) :].copy()
        return ServoState(
            arrays[kernel.CLOCKS].copy(), arrays[kernel.RUN].copy(), arrays[kernel.FRAMES].copy(),
            [row[:n].copy() for row, n in zip(arrays[kernel.ESTIMATES], self._sizes, strict=True)],
            arrays[kernel.SERVO].copy(), outputs,
        )  # fmt: skip

    @property
    def time(self) -> float:
        """Time that has been reached [s]."""
        return float(self._run[kernel.TIME])

    @property
    def outcome(self) -> int:
        """How the run stands."""
        return int(self._run[kernel.OUTCOME])

    def advance_to(self, boundary: float) -> None:
        """As `ServoLoop.advance_to`, and raises as that does."""
        ended = kernel.R_MORE
        while ended == kernel.R_MORE:
            self._make_room(boundary)
            ended = kernel.run_events(self._table, self._robot, self._steps, boundary)
            self._log.take(int(self._whole[kernel.LOGGED]))
        self._motion.forget()
        if ended == kernel.R_FAILED:  # it raises in Python what it is
            self._motion.advance(self.time)
            self._motion.cables()

    def _make_room(self, boundary: float) -> None:
        rows = math.ceil((boundary - self.time) * self._rate) + 2
        times, values = self._log.make_room(rows)
        arrays, whole = self._arrays, self._whole
        whole[kernel.LOGGED], whole[kernel.ROOM_FOR] = self._log.rows(), len(times)
        if values is not arrays[kernel.ROWS]:
            arrays[kernel.TIMES], arrays[kernel.ROWS] = times, values
            self._table = array_addresses(arrays)


def _floats(values: Any) -> Array:
    return np.ascontiguousarray(values, dtype=float)
