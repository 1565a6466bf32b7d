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
    """A projected camera and the images in its delay line.

    Attributes:
        outputs: Names by which its measurements are read.
    """

    def __init__(self, camera: ProjectedCamera, read: Read, outputs: set[str]) -> None:
        """Before the first image."""
        self._camera, self._read, self.outputs = camera, read, outputs
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
    """A sensor and its last sample.

    Attributes:
        outputs: The name by which it is read.
    """

    def __init__(self, sensor: SampledSensor, truth: Callable[[], Any], output: str) -> None:
        """Before the first sample."""
        self._sensor, self._truth, self.outputs = sensor, truth, {output}
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


class Estimate:
    """An estimator of the platform's pose and its memory.

    What it computes of an instant it keeps, until `forget` says that the time or an input changed.

    Attributes:
        memory: The memory of now; empty for an estimator that takes no steps.
        inputs: Names of what it reads.
    """

    def __init__(
        self,
        system: PoseEstimator | MeasuredPose | ShiftedPose,
        read: Read,
        now: Callable[[], float],
    ) -> None:
        """Before the first step; `now` gives the time [s]."""
        self._system, self._read, self._now = system, read, now
        ports = (system.get_input_port(index) for index in range(system.num_input_ports()))
        self.inputs = {port.get_name() for port in ports}
        self.take(system.start() if isinstance(system, PoseEstimator) else np.zeros(0))

    def take(self, memory: Array) -> None:
        """Makes a memory the one of now."""
        self.memory = memory
        if isinstance(self._system, PoseEstimator):
            self._believed = self._system.believed(memory)
        self.forget()

    def forget(self) -> None:
        """Has all computed again: the time or an input changed."""
        self._upcoming: tuple[Array, RigidTransform] | None = None
        self._pose: RigidTransform | None = None

    def pose(self) -> RigidTransform:
        """Estimate X_WP of now [m], with the step of control in it that is due."""
        if self._pose is None:
            system = self._system
            if isinstance(system, PoseEstimator):
                now, memory, believed = self._now(), self.memory, self._believed
                if system.is_due(memory, now):
                    memory, believed = self._after(system, now)
                self._pose = system.estimate(self._read, memory, now, believed)
            else:
                self._pose = system.passed_on(self._read("X_WP_measured"))
        return self._pose

    def step(self) -> None:
        """Takes the step of control of now."""
        if isinstance(self._system, PoseEstimator):
            self.memory, self._believed = self._after(self._system, self._now())
        self.forget()

    def _after(self, system: PoseEstimator, now: float) -> tuple[Array, RigidTransform]:
        """Memory after a step now, and the pose in it."""
        if self._upcoming is None:
            memory = system.upcoming(self._read, self.memory, now, self._believed)
            self._upcoming = memory, system.believed(memory)
        return self._upcoming
