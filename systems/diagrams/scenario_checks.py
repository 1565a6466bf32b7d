"""Checks of a scenario that need more than one field, or its robot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdpr_drake.errors import (
    CableGeometryError,
    CableModelError,
    Problems,
    RobotFileError,
    ScenarioError,
    VisualFeatureError,
)
from cdpr_drake.geometry.poses import adjoint
from cdpr_drake.models.camera_catalogue import fold_problem
from cdpr_drake.models.robot_holding import check_pulleys
from cdpr_drake.models.robot_schema import Pose, Robot
from cdpr_drake.numerics.explicit_integration import explicit_integrators
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.servoing.point_features import interaction_rank
from cdpr_drake.systems.cameras.camera_settings import REGION, WHOLE, check_camera, check_lens
from cdpr_drake.systems.diagrams.adaptation import check_adaptation
from cdpr_drake.systems.diagrams.beliefs import read_camera
from cdpr_drake.systems.diagrams.controller import check_scheme, make_tasks
from cdpr_drake.systems.diagrams.emergency import check_emergency
from cdpr_drake.systems.diagrams.fusion_checks import check_sensor_fusion
from cdpr_drake.systems.diagrams.pan_tilt import check_pan_tilt
from cdpr_drake.systems.diagrams.tension_management import check_tension_management
from cdpr_drake.systems.diagrams.torque_control import (
    check_pose_plan,
    check_torque_control,
    check_winch_groups,
)
from cdpr_drake.systems.diagrams.wrench_estimation import check_wrench_estimation
from cdpr_drake.systems.estimators.estimator_kinds import ESTIMATORS
from cdpr_drake.systems.remote.settings import check_servo_place
from cdpr_drake.systems.robots.cable_forces import simulated_cables
from cdpr_drake.systems.robots.cable_robot import SEMI_IMPLICIT
from cdpr_drake.systems.robots.disturbances import check_disturbances
from cdpr_drake.systems.robots.failures import check_failures
from cdpr_drake.systems.robots.settings import COMPILED
from cdpr_drake.systems.sensors.sensor_kinds import SENSORS
from cdpr_drake.systems.worlds.checks import check_world

if TYPE_CHECKING:
    from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario


def check_perturbations(scenario: Scenario, robot: Robot, path: Path) -> None:
    """Refuses lists that do not have one entry for each cable."""
    perturbations, m = scenario.perturbations, len(robot.cables)
    problems = Problems(ScenarioError)
    for name in ("exit_point_shifts", "anchor_point_shifts", "slack"):
        value = getattr(perturbations, name)
        if value is not None and len(value) != m:
            problems.add(
                f"{path}: perturbations.{name}: found {len(value)} rows; accepted: one for each "
                f"of the {m} cables of {robot.name}"
            )
    problems.raise_any()


def check_estimators(scenario: Scenario, robot: Robot, path: Path) -> None:
    """Refuses estimators that cannot work with this target, camera or known tag."""
    settings = scenario.estimator
    keys = {"estimator.kind": settings.kind}
    for index, name in enumerate(settings.compare):
        if name in settings.compare[:index]:
            raise ScenarioError(
                f"{path}: estimator.compare[{index}]: found {name} twice; accepted: each once"
            )
        keys[f"estimator.compare[{index}]"] = name
    blind = why_images_tell_nothing(scenario)
    for key, name in keys.items():
        if ESTIMATORS[name].needs_images and blind:
            others = [n for n, kind in ESTIMATORS.items() if not kind.needs_images]
            raise ScenarioError(
                f"{path}: {key}: found {name}, but {blind}; accepted: one of {', '.join(others)}"
            )
    _check_known_tag(scenario, "known_tag" in keys.values(), path)
    _check_platform_tag(scenario, robot, "eye_to_hand" in keys.values(), path)


def why_images_tell_nothing(scenario: Scenario) -> str:
    """Why the platform's pose does not follow from two images of the target; empty: it does."""
    target = scenario.target
    if target.carrier == "platform":
        return "the target moves with the platform and the camera stands in the world"
    if target.motion is not None and target.motion.moves():
        return (
            "the target moves, so what differs between two images is its own motion as well as "
            "the platform's"
        )
    if target.kind == "circles":
        return "circles do not show their rotation about their middle"
    return ""


def _check_known_tag(scenario: Scenario, needed: bool, path: Path) -> None:
    known, target = scenario.estimator.known_tag, scenario.target
    if known is None:
        if needed:
            raise ScenarioError(
                f"{path}: estimator.known_tag: found none; accepted for kind known_tag: a tag"
            )
        return
    if target.carrier == "platform":
        raise ScenarioError(
            f"{path}: estimator.known_tag: found a tag, but the camera stands in the world; "
            "accepted: null"
        )
    used = {"tag": [target.tag_id], "tag_bundle": [tag.tag_id for tag in target.tags]}
    if known.tag_id in used.get(target.kind, []):
        raise ScenarioError(
            f"{path}: estimator.known_tag.tag_id: found {known.tag_id}, that of the target; "
            "accepted: another"
        )


def _check_platform_tag(scenario: Scenario, robot: Robot, needed: bool, path: Path) -> None:
    tag = scenario.estimator.platform_tag
    if tag is None:
        if needed:
            raise ScenarioError(
                f"{path}: estimator.platform_tag: found none; accepted for kind eye_to_hand: a tag "
                "on the platform"
            )
        return
    mounts = [mount.name for mount in robot.cameras if mount.parent == "world"]
    if tag.mount not in mounts:
        raise ScenarioError(
            f"{path}: estimator.platform_tag.mount: {tag.mount!r} is not in the world of "
            f"{robot.name}; {closest(tag.mount, mounts)}"
        )


def check_scenario(scenario: Scenario, robot: Robot, path: Path) -> None:
    """Refuses what the robot cannot do or what contradicts itself.

    Raises:
        ScenarioError: Names the file, the field, what was found and what is accepted; one line for
            each check that found something.
    """
    problems = Problems(ScenarioError)
    for check in CHECKS:
        with problems.collected():
            check(scenario, robot, path)
    problems.raise_any()


def _check_mount(scenario: Scenario, robot: Robot, path: Path) -> None:
    """A camera on the platform looks at the world, one in the world at the platform."""
    on_platform = scenario.target.carrier == "platform"
    parent = "world" if on_platform else "platform"
    mounts = [mount.name for mount in robot.cameras if mount.parent == parent]
    if scenario.camera.mount not in mounts:
        where = "in the world, as target.carrier=platform needs," if on_platform else ""
        where = where or "on the platform"
        raise ScenarioError(
            f"{path}: camera.mount: {scenario.camera.mount!r} is not {where} of {robot.name}; "
            f"{closest(scenario.camera.mount, mounts)}"
        )


def _check_camera(scenario: Scenario, robot: Robot, path: Path) -> None:
    check_camera(scenario.camera, path)
    check_lens(scenario.camera, robot, path)
    wrong, where = scenario.perturbations, f"{path}: perturbations"
    if wrong.camera_distortion is not None and wrong.camera_distortion.problem():
        raise ScenarioError(f"{where}.camera_distortion.{wrong.camera_distortion.problem()}")
    try:
        camera = read_camera(scenario, robot)
    except RobotFileError as problem:
        raise ScenarioError(*problem.within(f"{where}.camera_model")) from problem
    if camera.believed is not None and fold_problem(camera.believed):
        raise ScenarioError(f"{where}.camera_distortion: {fold_problem(camera.believed)}")
    if camera.believed is not None and scenario.camera.region == REGION:
        raise ScenarioError(
            f"{path}: camera.region: found {REGION} with a camera that is believed to be another; "
            f"accepted: {WHOLE}"
        )


def _check_poses(scenario: Scenario, robot: Robot, path: Path) -> None:
    poses = {"initial_pose": scenario.initial_pose}
    if scenario.perturbations.initial_pose is not None:
        poses["perturbations.initial_pose"] = scenario.perturbations.initial_pose
    for k, point in enumerate(scenario.open_loop.waypoints if scenario.open_loop else []):
        poses[f"open_loop.waypoints[{k}].pose"] = point.pose
    problems = Problems(ScenarioError)
    below = 0.0 if scenario.world is None else scenario.world.room_below()
    lower, upper = robot.frame.bounds()
    lower = lower - [0.0, 0.0, below]
    for key, pose in poses.items():
        if np.any(pose.position < lower) or np.any(pose.position > upper):
            problems.add(
                f"{path}: {key}.position: found {words(pose.position)}, outside the frame; "
                f"accepted: {words(lower)} to {words(upper)} [m]"
            )
        elif robot.motion_type().is_horizontal_body:
            with problems.collected():
                _check_planar(key, pose, robot, path)
    problems.raise_any()


def _check_planar(key: str, pose: Pose, robot: Robot, path: Path) -> None:
    if pose.position[2] != robot.plane_height or np.any(pose.angles_deg[:2] != 0.0):
        raise ScenarioError(
            f"{path}: {key}: found {words(pose.position)} m, {words(pose.angles_deg)} "
            f"deg; accepted for the planar {robot.name}: z = {robot.plane_height:g} m, "
            "phi = theta = 0"
        )


def _check_gains(scenario: Scenario, robot: Robot, path: Path) -> None:
    controller = scenario.controller
    if controller.lambda_infinity > controller.lambda_0:
        raise ScenarioError(
            f"{path}: controller.lambda_infinity: found {controller.lambda_infinity:g}; "
            f"accepted: at most lambda_0 = {controller.lambda_0:g} [1/s]"
        )


def _check_target(scenario: Scenario, robot: Robot, path: Path) -> None:
    target = scenario.target
    ids = [tag.tag_id for tag in target.tags]
    if target.kind == "tag_bundle" and (not ids or len(set(ids)) != len(ids)):
        found = f"the identities {ids}" if ids else "none"
        raise ScenarioError(
            f"{path}: target.tags: found {found}; accepted: at least one tag, each identity once"
        )
    motion = target.motion
    if motion is None:
        return
    if target.carrier == "platform":
        raise ScenarioError(
            f"{path}: target.motion: found a motion of a target that the platform carries; "
            "accepted: null, or target.carrier=world"
        )
    times = [point.time for point in motion.waypoints]
    if times != sorted(set(times)):
        raise ScenarioError(
            f"{path}: target.motion.waypoints: found the times {times}; accepted: growing ones"
        )
    kinds = {
        "waypoints": bool(times),
        "a velocity": motion.has_velocity(),
        "a mobile_robot": motion.mobile_robot is not None,
    }
    asked = [words for words, there in kinds.items() if there]
    if len(asked) > 1:
        raise ScenarioError(
            f"{path}: target.motion: found {' and '.join(asked)}; accepted: one of them"
        )
    carrier = motion.mobile_robot
    if carrier is not None and carrier.corner_radius > 0.5 * min(carrier.length, carrier.width):
        raise ScenarioError(
            f"{path}: target.motion.mobile_robot.corner_radius: found {carrier.corner_radius:g}; "
            f"accepted: at most {0.5 * min(carrier.length, carrier.width):g} [m], half the shorter "
            "side of the track"
        )


def _check_tasks(scenario: Scenario, robot: Robot, path: Path) -> None:
    """The target shows what the scheme needs, and that controls the motions at every goal."""
    poses = {"desired": scenario.desired}
    for k, task in enumerate(scenario.next_tasks):
        poses[f"next_tasks[{k}].desired"] = task.desired
    for k, pose in enumerate(scenario.trajectory.waypoints if scenario.trajectory else []):
        poses[f"trajectory.waypoints[{k}]"] = pose
    for key, pose in poses.items():
        if pose.position[2] <= 0.0:
            raise ScenarioError(
                f"{path}: {key}.position: found {words(pose.position)}; "
                "accepted: z > 0 [m], in front of the camera"
            )
    times = [task.time for task in scenario.next_tasks]
    if times != sorted(set(times)):
        raise ScenarioError(f"{path}: next_tasks: found the times {times}; accepted: growing ones")
    try:
        tasks = make_tasks(scenario, scenario.target.target())
        check_scheme(scenario, robot, scenario.target.target())
    except VisualFeatureError as problem:
        raise ScenarioError(f"{path}: {problem}") from problem
    features = tasks[0].features
    if scenario.controller.yaw is not None and (
        features.rank == 6 or robot.motion_type().is_horizontal_body
    ):
        raise ScenarioError(
            f"{path}: controller.yaw: found a secondary task, but {scenario.controller.scheme} "
            "leaves no motion free; accepted: null, controller.free_rotation=true, or circles"
        )
    for key, goal in zip(poses, tasks, strict=False):
        L = goal.L_desired
        if robot.motion_type().is_horizontal_body:
            X_PC = robot.camera_mount(scenario.camera.mount).pose.transform()
            L = L @ adjoint(X_PC.inverse())[:, [2, 3, 4]]
        needed = min(features.rank, L.shape[1])
        rank = interaction_rank(L)
        if rank < needed:
            raise ScenarioError(
                f"{path}: {key}: the interaction matrix of {scenario.controller.scheme} is "
                f"singular there: its {len(features.names)} features control {rank} motions; "
                f"accepted: a pose, or points, where they control {needed}"
            )


def _check_cables(scenario: Scenario, robot: Robot, path: Path) -> None:
    settings = scenario.cables
    if scenario.stop.broken_cable and not robot.knows_breaking_loads():
        raise ScenarioError(
            f"{path}: stop.broken_cable: found true; accepted: false, since the file of "
            f"{robot.name} gives no cable.breaking_load"
        )
    try:
        cables = settings.cable_set(robot)
        simulated_cables(cables, settings.model_of(robot))
        check_pulleys(robot, scenario.initial_pose.transform(), cables)
    except (CableModelError, CableGeometryError) as problem:
        raise ScenarioError(f"{path}: cables: {problem}") from problem


def _check_disturbances(scenario: Scenario, robot: Robot, path: Path) -> None:
    check_disturbances(scenario.disturbances, path)


def _check_failures(scenario: Scenario, robot: Robot, path: Path) -> None:
    check_failures(
        scenario.failures, robot, scenario.winches.has_motors(), scenario.sensors.sampled(), path
    )


def _check_winches(scenario: Scenario, robot: Robot, path: Path) -> None:
    winches, step = scenario.winches, scenario.integration.max_step
    if not winches.has_motors():
        if winches.mode != "velocity":
            raise ScenarioError(
                f"{path}: winches.mode: found {winches.mode} with ideal winches; accepted: "
                "velocity, or winches.kind motor"
            )
        return
    try:
        law = robot.winch_law()
    except RobotFileError as problem:
        raise ScenarioError(f"{path}: winches.kind: found motor; {problem}") from problem
    largest = 2.0 * law.friction.settling_time
    explicit = scenario.integration.integrator != SEMI_IMPLICIT
    dry = law.friction.static > 0.0 or scenario.failures is not None
    if explicit and dry and step is not None and step > largest:
        raise ScenarioError(
            f"{path}: integration.max_step: found {step:g}; accepted: at most {largest:g} [s], "
            f"twice the winch.friction.settling_time of {robot.name}"
        )


def _check_integration(scenario: Scenario, robot: Robot, path: Path) -> None:
    integration = scenario.integration
    if integration.engine == COMPILED:
        return
    if integration.integrator == SEMI_IMPLICIT:
        raise ScenarioError(
            f"{path}: integration.integrator: found {SEMI_IMPLICIT} with the engine plant; "
            f"accepted: {' or '.join(explicit_integrators())}, or integration.engine compiled"
        )
    if integration.accuracy is not None:
        raise ScenarioError(
            f"{path}: integration.accuracy: found {integration.accuracy:g} with the engine plant, "
            "whose steps are fixed; accepted: null, or integration.engine compiled"
        )


def _check_sensors(scenario: Scenario, robot: Robot, path: Path) -> None:
    settings = scenario.sensors
    problems = Problems(ScenarioError)
    for sensor in SENSORS:
        rate, largest = settings.rate(sensor), settings.largest_rate(sensor)
        if rate is not None and largest is not None and rate > largest:
            problems.add(
                f"{path}: sensors.{sensor}_rate: found {rate:g}; accepted: at most {largest:g} "
                f"[Hz], that of {settings.kind(sensor)}"
            )
    on_wheels = (
        scenario.target.motion is not None and scenario.target.motion.mobile_robot is not None
    )
    bodies = ["target"] if scenario.target.carrier == "world" else []
    if scenario.world is not None:
        bodies += scenario.world.moving()
    for problem in settings.problems(on_wheels, bodies):
        problems.add(f"{path}: sensors.{problem}")
    for index, sensor in enumerate(settings.log):
        if sensor in settings.log[:index]:
            problems.add(f"{path}: sensors.log[{index}]: found {sensor} twice; accepted: each once")
    problems.raise_any()


def _check_world(scenario: Scenario, robot: Robot, path: Path) -> None:
    check_world(
        scenario.world, robot, scenario.initial_pose.transform(), path,
        compiled=scenario.integration.engine == COMPILED, stop=scenario.stop.contact,
    )  # fmt: skip


def words(values: np.ndarray) -> str:
    """Numbers as "(1, 2, 3)", for messages."""
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"


CHECKS: list[Callable[[Scenario, Robot, Path], None]] = [
    _check_mount,
    _check_camera,
    check_pan_tilt,
    _check_poses,
    _check_gains,
    _check_target,
    _check_tasks,
    check_perturbations,
    check_estimators,
    check_sensor_fusion,
    check_tension_management,
    check_adaptation,
    _check_cables,
    _check_disturbances,
    _check_failures,
    check_emergency,
    check_wrench_estimation,
    _check_winches,
    check_winch_groups,
    check_torque_control,
    check_pose_plan,
    _check_integration,
    _check_sensors,
    check_servo_place,
    _check_world,
]
"""Every check of a scenario, in order; each raises a ScenarioError or says nothing."""
