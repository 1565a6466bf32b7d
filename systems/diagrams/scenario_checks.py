"""What a scenario of a visual servo is refused for beside what its sections say themselves."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from cdpr_drake.errors import (
    CableGeometryError,
    CableModelError,
    RobotFileError,
    VisualFeatureError,
)
from cdpr_drake.geometry.poses import adjoint
from cdpr_drake.models.camera_catalogue import fold_refusals
from cdpr_drake.models.robot_holding import check_pulleys
from cdpr_drake.numerics.explicit_integration import explicit_integrators
from cdpr_drake.schema.declarations import Refusal, Scope, number_words, told
from cdpr_drake.servoing.point_features import interaction_rank
from cdpr_drake.systems.cameras.camera_settings import REGION, WHOLE
from cdpr_drake.systems.diagrams.beliefs import read_camera
from cdpr_drake.systems.diagrams.controller import make_tasks, scheme_refusals
from cdpr_drake.systems.diagrams.fusion_checks import fusion_refusals
from cdpr_drake.systems.diagrams.tension_management import management_refusals
from cdpr_drake.systems.diagrams.torque_control import (
    torque_refusals,
    winch_group_refusals,
)
from cdpr_drake.systems.estimators.estimator_kinds import ESTIMATORS
from cdpr_drake.systems.robots.cable_forces import simulated_cables
from cdpr_drake.systems.robots.cable_robot import SEMI_IMPLICIT
from cdpr_drake.systems.robots.settings import COMPILED
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.worlds.checks import world_refusals


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


def _perturbations(scope: Scope) -> Iterator[Refusal]:
    """Lists that do not have one entry for each cable."""
    m = len(scope.robot.cables)
    for name in ("exit_point_shifts", "anchor_point_shifts", "slack"):
        value = getattr(scope.whole.perturbations, name)
        if value is not None and len(value) != m:
            accepted = f"one for each of the {m} cables of {scope.robot.name}"
            yield f"perturbations.{name}", f"{len(value)} rows", accepted


def _estimators(scope: Scope) -> Iterator[Refusal]:
    """Estimators that cannot work with this target, camera or known tag."""
    scenario, settings = scope.whole, scope.whole.estimator
    keys = {"estimator.kind": settings.kind}
    for index, name in enumerate(settings.compare):
        if name in settings.compare[:index]:
            yield f"estimator.compare[{index}]", f"{name} twice", "each once"
        keys[f"estimator.compare[{index}]"] = name
    blind = why_images_tell_nothing(scenario)
    for key, name in keys.items():
        if ESTIMATORS[name].needs_images and blind:
            others = [n for n, kind in ESTIMATORS.items() if not kind.needs_images]
            yield key, f"{name}, but {blind}", f"one of {', '.join(others)}"
    known, target = settings.known_tag, scenario.target
    used = {"tag": [target.tag_id], "tag_bundle": [tag.tag_id for tag in target.tags]}
    if known is None and "known_tag" in keys.values():
        yield "estimator.known_tag", "none", "a tag, for kind known_tag"
    elif known is not None and target.carrier == "platform":
        yield "estimator.known_tag", "a tag, but the camera stands in the world", "null"
    elif known is not None and known.tag_id in used.get(target.kind, []):
        yield "estimator.known_tag.tag_id", f"{known.tag_id}, that of the target", "another"
    tag = settings.platform_tag
    mounts = [mount.name for mount in scope.robot.cameras if mount.parent == "world"]
    if tag is None and "eye_to_hand" in keys.values():
        accepted = "a tag on the platform, for kind eye_to_hand"
        yield "estimator.platform_tag", "none", accepted
    elif tag is not None and tag.mount not in mounts:
        found = f"{tag.mount!r}, which is not in the world of {scope.robot.name}"
        yield "estimator.platform_tag.mount", found, _one_of(mounts)


def _one_of(names: list[str]) -> str:
    return f"one of {', '.join(names)}" if names else "a robot with such a camera"


def _mount(scope: Scope) -> Iterator[Refusal]:
    """A camera on the platform looks at the world, one in the world at the platform."""
    mount, on_platform = scope.whole.camera.mount, scope.whole.target.carrier == "platform"
    parent = "world" if on_platform else "platform"
    mounts = [each.name for each in scope.robot.cameras if each.parent == parent]
    if mount not in mounts:
        where = "in the world, as target.carrier=platform needs," if on_platform else ""
        where = where or "on the platform"
        found = f"{mount!r}, which is not {where} of {scope.robot.name}"
        yield "camera.mount", found, _one_of(mounts)


def _believed_camera(scope: Scope) -> Iterator[Refusal]:
    """A camera that is believed in and is none."""
    scenario, key = scope.whole, "perturbations.camera_distortion"
    lens = scenario.perturbations.camera_distortion
    if any(scenario.camera.refusals(scope)) or (lens and any(lens.refusals(scope))):
        return
    try:
        believed = read_camera(scenario, scope.robot).believed
    except RobotFileError as problem:
        yield told(problem, "perturbations.camera_model")
        return
    if believed is not None:
        yield from fold_refusals(believed, key)
        if scenario.camera.region == REGION:
            found = f"{REGION} with a camera that is believed to be another"
            yield "camera.region", found, WHOLE


def _poses(scope: Scope) -> Iterator[Refusal]:
    """Poses of the platform outside of the frame, or not in the plane of a planar robot."""
    scenario, robot = scope.whole, scope.robot
    poses = {"initial_pose": scenario.initial_pose}
    if scenario.perturbations.initial_pose is not None:
        poses["perturbations.initial_pose"] = scenario.perturbations.initial_pose
    for k, point in enumerate(scenario.open_loop.waypoints if scenario.open_loop else []):
        poses[f"open_loop.waypoints[{k}].pose"] = point.pose
    below = 0.0 if scenario.world is None else scenario.world.room_below()
    lower, upper = robot.frame.bounds()
    lower = lower - [0.0, 0.0, below]
    is_planar = robot.motion_type().is_horizontal_body
    for key, pose in poses.items():
        p, angles = pose.position, pose.angles_deg
        if np.any(p < lower) or np.any(p > upper):
            accepted = f"{number_words(lower)} to {number_words(upper)} [m]"
            yield f"{key}.position", f"{number_words(p)}, outside the frame", accepted
        elif is_planar and (p[2] != robot.plane_height or np.any(angles[:2] != 0.0)):
            found = f"{number_words(p)} m, {number_words(angles)} deg"
            plane = f"z = {robot.plane_height:g} m, phi = theta = 0"
            yield key, found, f"{plane} for the planar {robot.name}"


def _tasks(scope: Scope) -> Iterator[Refusal]:
    """The target shows what the scheme needs, and that controls the motions at every goal."""
    scenario, robot, before = scope.whole, scope.robot, False
    poses = {"desired": scenario.desired}
    for k, task in enumerate(scenario.next_tasks):
        poses[f"next_tasks[{k}].desired"] = task.desired
    for k, pose in enumerate(scenario.trajectory.waypoints if scenario.trajectory else []):
        poses[f"trajectory.waypoints[{k}]"] = pose
    for key, pose in poses.items():
        if pose.position[2] <= 0.0:
            accepted, before = "z > 0 [m], in front of the camera", True
            yield f"{key}.position", number_words(pose.position), accepted
    times = [task.time for task in scenario.next_tasks]
    if times != sorted(set(times)):
        yield "next_tasks", f"the times {times}", "growing ones"
    if before or any(_mount(scope)) or any(scenario.target.refusals(scope)):
        return
    target = scenario.target.target()
    try:
        tasks = make_tasks(scenario, target)
    except VisualFeatureError as problem:
        yield told(problem, "controller")
        return
    yield from scheme_refusals(scenario, robot, target)
    features, scheme = tasks[0].features, scenario.controller.scheme
    is_planar = robot.motion_type().is_horizontal_body
    if scenario.controller.yaw is not None and (features.rank == 6 or is_planar):
        found = f"a secondary task, but {scheme} leaves no motion free"
        yield "controller.yaw", found, "null, controller.free_rotation=true, or circles"
    for key, goal in zip(poses, tasks, strict=False):
        L = goal.L_desired
        if is_planar:
            X_PC = robot.camera_mount(scenario.camera.mount).pose.transform()
            L = L @ adjoint(X_PC.inverse())[:, [2, 3, 4]]
        needed, rank = min(features.rank, L.shape[1]), interaction_rank(L)
        if rank < needed:
            found = (
                f"a pose where the interaction matrix of {scheme} is singular: its "
                f"{len(features.names)} features control {rank} motions"
            )
            yield key, found, f"a pose, or points, where they control {needed}"


def _cables(scope: Scope) -> Iterator[Refusal]:
    """Cables that cannot be simulated, and a wish to stop where none of them breaks."""
    scenario, robot, settings = scope.whole, scope.robot, scope.whole.cables
    if scenario.stop.broken_cable and not robot.knows_breaking_loads():
        accepted = f"false, since the file of {robot.name} gives no cable.breaking_load"
        yield "stop.broken_cable", "true", accepted
    try:
        cables = settings.cable_set(robot)
        simulated_cables(cables, settings.model_of(robot))
        check_pulleys(robot, scenario.initial_pose.transform(), cables)
    except (CableModelError, CableGeometryError) as problem:
        yield told(problem, "cables")


def _winches(scope: Scope) -> Iterator[Refusal]:
    """Motors that the robot's file does not know, or steps that are too large for them."""
    winches, integration = scope.whole.winches, scope.whole.integration
    if not winches.has_motors():
        if winches.mode != "velocity":
            accepted = "velocity, or winches.kind motor"
            yield "winches.mode", f"{winches.mode} with ideal winches", accepted
        return
    try:
        law = scope.robot.winch_law()
    except RobotFileError as problem:
        yield told(problem, "winches.kind")
        return
    step, largest = integration.max_step, 2.0 * law.friction.settling_time
    dry = law.friction.static > 0.0 or scope.whole.failures is not None
    if integration.integrator != SEMI_IMPLICIT and dry and step is not None and step > largest:
        time = f"twice the winch.friction.settling_time of {scope.robot.name}"
        yield "integration.max_step", f"{step:g}", f"at most {largest:g} [s], {time}"


def _integration(scope: Scope) -> Iterator[Refusal]:
    """What the engine does not know."""
    integration = scope.whole.integration
    if integration.engine == COMPILED:
        return
    if integration.integrator == SEMI_IMPLICIT:
        accepted = f"{' or '.join(explicit_integrators())}, or integration.engine compiled"
        yield "integration.integrator", f"{SEMI_IMPLICIT} with the engine plant", accepted
    if integration.accuracy is not None:
        found = f"{integration.accuracy:g} with the engine plant, whose steps are fixed"
        yield "integration.accuracy", found, "null, or integration.engine compiled"


def _world(scope: Scope) -> Iterator[Refusal]:
    scenario = scope.whole
    yield from world_refusals(
        scenario.world, scope.robot, scenario.initial_pose.transform(),
        compiled=scenario.integration.engine == COMPILED, stop=scenario.stop.contact,
    )  # fmt: skip


SERVO_REFUSALS: tuple[Callable[[Scope], Iterator[Refusal]], ...] = (
    _mount,
    _believed_camera,
    _poses,
    _tasks,
    _perturbations,
    _estimators,
    fusion_refusals,
    management_refusals,
    _cables,
    _winches,
    winch_group_refusals,
    torque_refusals,
    _integration,
    _world,
)
"""Every check of a scenario against its robot, in order."""
