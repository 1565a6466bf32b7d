"""Adds the sensors of a section `sensors` that look round to a robot in somebody's builder."""

from __future__ import annotations

from dataclasses import dataclass

from pydrake.systems.framework import DiagramBuilder, OutputPort

from cdpr_drake.systems.robots.assembly import RobotBlock
from cdpr_drake.systems.sections import sections_of
from cdpr_drake.systems.sensors.sensor_settings import SensorSuite
from cdpr_drake.trajectories.pose_trajectory import MovingPose


@dataclass(frozen=True, kw_only=True)
class _Robot:
    """What sections of sensors read of a servo's blocks, and of its settings."""

    block: RobotBlock
    sensors: SensorSuite
    seed: int
    motion: MovingPose | None
    prefix: str


def add_perception_sensors(
    builder: DiagramBuilder,
    robot: RobotBlock,
    suite: SensorSuite,
    *,
    seed: int = 0,
    motion: MovingPose | None = None,
    name: str = "",
) -> dict[str, OutputPort]:
    """Adds what a section `sensors` asks for beside what estimators read, to a robot without a
    servo; `add_visual_servo` adds it to others.

    Args:
        builder: The builder that has the robot.
        robot: The robot, with a scene graph.
        suite: The section.
        seed: Seed of all noise; each sensor draws from a stream of its own.
        motion: How the target moves, for odometry.
        name: Put before the names of the blocks: scan_NAME, imu, depth_camera, depth, pan_tilt,
            pan_tilt_command, odometry.

    Returns:
        What a run logs of them, by the name in the log.

    Raises:
        RenderingError: There is a depth camera, and EGL is missing.
        ScenarioError: Odometry is asked for of a target that no mobile robot carries, or something
            that is not there carries a sensor.
    """
    prefix = f"{name}_" if name else ""
    about = _Robot(block=robot, sensors=suite, seed=seed, motion=motion, prefix=prefix)
    ports: dict[str, OutputPort] = {}
    for _, section in sections_of(suite):
        ports.update(section.add_to(builder, about, about))
    return ports
