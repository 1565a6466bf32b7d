"""Checks of a scenario that asks for fusion of sensors, or for a camera that fails."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cdpr_drake.errors import Problems, ScenarioError
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.cameras.camera_settings import PROJECTED
from cdpr_drake.systems.diagrams.fusion_models import is_asked_for, steers
from cdpr_drake.vision.target import PointTarget

if TYPE_CHECKING:
    from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario


def check_sensor_fusion(scenario: Scenario, robot: Robot, path: Path) -> None:
    """Refuses sources that are not there, and faults of cameras that cannot have them.

    Raises:
        ScenarioError: One line for each problem.
    """
    problems = Problems(ScenarioError)
    for problem in _fault_problems(scenario, robot):
        problems.add(f"{path}: {problem}")
    if is_asked_for(scenario):
        for problem in _source_problems(scenario, robot):
            problems.add(f"{path}: estimator.sensor_fusion.{problem}")
    problems.raise_any()


def _fault_problems(scenario: Scenario, robot: Robot) -> list[str]:
    """What is wrong with the cameras themselves, one line each that begins with the field."""
    camera, tag, found = scenario.camera, scenario.estimator.platform_tag, list[str]()
    if camera.fault is not None and camera.kind != PROJECTED:
        found.append(
            f"camera.fault: found a fault with camera.kind {camera.kind}; accepted: null, or "
            f"camera.kind {PROJECTED}"
        )
    mounts = {mount.name: mount for mount in robot.cameras}
    if tag is not None and tag.rate is not None and tag.mount in mounts:
        fastest = load_camera(mounts[tag.mount].model).rate_hz
        if tag.rate > fastest:
            found.append(
                f"estimator.platform_tag.rate: found {tag.rate:g}; accepted: at most {fastest:g} "
                f"[Hz], that of {mounts[tag.mount].model}"
            )
    return found


def _source_problems(scenario: Scenario, robot: Robot) -> list[str]:
    """What is wrong with the sources, one line each that begins with the field."""
    fusion, target, found = scenario.estimator.sensor_fusion, scenario.target, list[str]()
    if not (fusion.on_board or fusion.external or fusion.lengths):
        found.append("on_board: found no source; accepted: on_board, external or lengths true")
    if robot.motion_type().freedom != 6:
        found.append(f"on_board: found {robot.name}, which is planar; accepted: a robot in space")
    for name, used in (("on_board", fusion.on_board), ("steer", steers(scenario))):
        if not used:
            continue
        if not scenario.target_rests():
            found.append(
                f"{name}: found true, but the target does not rest in the world; accepted: false"
            )
        if not isinstance(target.target(), PointTarget):
            found.append(
                f"{name}: found true with target.kind {target.kind}; accepted: false, or a target "
                "of points"
            )
    if steers(scenario) and not fusion.on_board and fusion.told_object is None:
        found.append(
            "told_object: found none, and nothing else tells where the target is; accepted: what "
            "is known of it, on_board true, or steer false"
        )
    if fusion.external and scenario.estimator.platform_tag is None:
        found.append(
            "external: found true without estimator.platform_tag; accepted: false, or a tag on the "
            "platform"
        )
    if fusion.imu and scenario.sensors.imu is None:
        found.append("imu: found true without sensors.imu; accepted: false, or an IMU")
    for name in ("on_board", "external"):
        if getattr(fusion, f"{name}_depth") is not None and not getattr(fusion, name):
            found.append(
                f"{name}_depth: found {getattr(fusion, f'{name}_depth')} with {name} false; "
                "accepted: null"
            )
    for name in ("on_board", "external"):
        doubt = getattr(fusion, f"{name}_doubt")
        for field in ("position", "rotation_deg"):
            told = getattr(fusion, f"{name}_{field}")
            if doubt is not None and getattr(doubt, field) <= told:
                found.append(
                    f"{name}_doubt.{field}: found {getattr(doubt, field):g}; accepted: more than "
                    f"{name}_{field}, which is {told:g}"
                )
    return found
