"""What a loop holds of camera, estimator and sensor: the block's memory, and what it shows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.systems.estimators.basic_estimators import MeasuredPose, ShiftedPose
from cdpr_drake.systems.estimators.estimator_kinds import ESTIMATORS, EstimatorTask
from cdpr_drake.systems.estimators.pose_estimator import PoseEstimator
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.sensors.sampled_sensor import SampledSensor
from cdpr_drake.systems.sensors.sensor_readings import make_sensor

Read = Callable[[str], Any]
"""Gives what stands at an input, by its name."""


def checked_estimator(kind: str, task: EstimatorTask) -> PoseEstimator | MeasuredPose | ShiftedPose:
    """An estimator that a loop can call.

    Raises:
        ScenarioError: It is a block that only a diagram can step.
    """
    system: Any = ESTIMATORS[kind].make(task)
    if not isinstance(system, PoseEstimator | MeasuredPose | ShiftedPose):
        raise ScenarioError(f"the estimator {kind} is a block that only a diagram can step")
    return system


def checked_sensor(name: str, scenario: Scenario, robot: Robot) -> SampledSensor | None:
    """A sensor that a loop can call, None where it is ideal.

    Raises:
        ScenarioError: It is a block that only a diagram can step.
    """
    sensor: Any = make_sensor(name, scenario.sensors, robot, scenario.seed)
    if sensor is not None and not isinstance(sensor, SampledSensor):
        raise ScenarioError(f"the sensor {name} is a block that only a diagram can step")
    return sensor


class DelayedCamera:
    """A projected camera and the images in its delay line."""

    def __init__(self, camera: ProjectedCamera, read: Read) -> None:
        """Before the first image."""
        self._camera, self._read = camera, read
        self.take(camera.no_frames())

    def after(self, now: float) -> Array:
        """The delay line after an image of a time [s]."""
        return self._camera.next_frames(
            self._frames, self._camera.image(self._read, now, self._frames)
        )

    def take(self, frames: Array) -> None:
        """Makes it the delay line of now."""
        self._frames = frames
        frame = self._camera.oldest(frames)
        self._found, self._marks = frame[:1], self._camera.marks_of(frame)
        self._pose = self._camera.pose_of(frame)

    def frames(self) -> Array:
        """The delay line of now."""
        return self._frames

    def found(self) -> Array:
        """1 or 0, shape (1,)."""
        return self._found

    def marks(self) -> Array:
        """Marks of the target, shape (target.size,)."""
        return self._marks

    def pose(self) -> RigidTransform:
        """Pose X_CO of the target [m]."""
        return self._pose


class Sampled:
    """A sensor and its last sample."""

    def __init__(self, sensor: SampledSensor, truth: Callable[[], Any]) -> None:
        """Before the first sample."""
        self._sensor, self._truth = sensor, truth
        self.take(sensor.nothing())

    def after(self, now: float) -> Array:
        """The sample of a time [s]."""
        return self._sensor.measure(self._truth(), self._sensor.number_at(now))

    def take(self, sample: Array) -> None:
        """Makes it the last one."""
        self._sample, self._reading = sample, self._sensor.reading(sample)

    def sample(self) -> Array:
        """The last one."""
        return self._sample

    def reading(self) -> Any:
        """What it says."""
        return self._reading


class _Believed:
    """The pose in an estimator's memory, unpacked once."""

    def __init__(self, system: PoseEstimator) -> None:
        """Of an estimator; before the first memory."""
        self._system, self._memory, self._pose = system, np.zeros(0), RigidTransform()

    def at(self, memory: Array) -> RigidTransform:
        """The pose X_WP of a memory [m]."""
        if self._memory is not memory:
            self._memory, self._pose = memory, self._system.believed(memory)
        return self._pose


class _Kept:
    """What was computed last, while time, memory and what was read for it stay.

    Whatever changes in a loop is another object.
    """

    def __init__(
        self,
        compute: Callable[[Read, Array, float, RigidTransform], Any],
        read: Read,
        believed: _Believed,
    ) -> None:
        """With what computes it from inputs, memory, time [s] and the pose in the memory, and
        what gives the inputs and that pose."""
        self._compute, self._read, self._believed = compute, read, believed
        self._inputs: dict[str, Any] = {}
        self._memory, self._time = np.zeros(0), np.nan
        self._value: Any = None

    def at(self, memory: Array, time: float) -> Any:
        """The value of a memory at a time [s]."""
        if self._time == time and self._memory is memory and self._unchanged():
            return self._value
        self._inputs = {}
        self._value = self._compute(self._remember, memory, time, self._believed.at(memory))
        self._memory, self._time = memory, time
        return self._value

    def _remember(self, name: str) -> Any:
        value = self._inputs[name] = self._read(name)
        return value

    def _unchanged(self) -> bool:
        for name, value in self._inputs.items():  # noqa: SIM110  # a generator costs more
            if self._read(name) is not value:
                return False
        return True


class Estimate:
    """An estimator of the platform's pose and its memory."""

    def __init__(
        self,
        system: PoseEstimator | MeasuredPose | ShiftedPose,
        read: Read,
        now: Callable[[], float],
    ) -> None:
        """Before the first step; `now` gives the time [s]."""
        self._read, self._now = read, now
        self._system = system
        self.memory, self._takes_steps = np.zeros(0), isinstance(system, PoseEstimator)
        if isinstance(system, PoseEstimator):
            self.memory, self._is_due = system.start(), system.is_due
            self._believed = _Believed(system)
            self._upcoming = _Kept(system.upcoming, read, self._believed)
            self._pose = _Kept(system.estimate, read, self._believed)

    def pose(self) -> RigidTransform:
        """Estimate X_WP of now [m]."""
        system = self._system
        if isinstance(system, MeasuredPose | ShiftedPose):
            return system.passed_on(self._read("X_WP_measured"))
        time = self._now()
        memory = self.memory
        if self._is_due(memory, time):
            memory = self._upcoming.at(memory, time)
        pose: RigidTransform = self._pose.at(memory, time)
        return pose

    def after(self) -> Array:
        """The memory after a step now; that of before of an estimator that takes no steps."""
        if not self._takes_steps:
            return self.memory
        after: Array = self._upcoming.at(self.memory, self._now())
        return after

    def take(self, memory: Array) -> None:
        """Makes it the memory of now."""
        self.memory = memory
