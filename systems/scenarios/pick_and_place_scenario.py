"""The schema of a scenario file for picking a box up and setting it down."""

from collections.abc import Iterator
from typing import Annotated

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.numerics.explicit_integration import explicit_integrators
from cdpr_drake.schema.declarations import FASTEST, In, OneOf, Refusal, Scope, filled, settings
from cdpr_drake.systems.robots.settings import PLANT, CableRobotSettings
from cdpr_drake.systems.scenarios.files import PICK_AND_PLACE, VISUAL_SERVO
from cdpr_drake.systems.scenarios.pick_and_place_settings import (
    BoxCameraSettings,
    CoverSettings,
    GoalCameraSettings,
    GoalSettings,
    GripperSettings,
    HandlingErrors,
    HandlingSettings,
    ScatterSettings,
    WorkpieceSettings,
)
from cdpr_drake.systems.scenarios.run_settings import ScenarioHeader
from cdpr_drake.systems.sensors.sensor_kinds import SensorSettings
from cdpr_drake.systems.worlds.checks import world_refusals

DEAD_RECKONING = (
    "control_integration", "cable_lengths", "cable_lengths_elastic", "cable_lengths_pulleys",
    "cable_lengths_elastic_pulleys",
)  # fmt: skip
"""Estimators that need no image."""

LEVEL = 1e-9
"""Turn about x or y of a pose that counts as level [deg]."""


@settings
class PlantIntegration:
    """How the robot is integrated, with the box, which the compiled engine does not have."""

    engine: Annotated[str, OneOf((PLANT,)), "What moves the robot."] = PLANT
    integrator: Annotated[
        str, OneOf(explicit_integrators()), "Explicit integrator of Drake, fixed step."
    ] = "runge_kutta3"
    max_step: Annotated[
        float | None,
        In("s", gt=0.0),
        "Step; null: a share of the largest stable one, of cables, grip and contact.",
    ] = None


@settings
class DeadReckoning:
    """How the robot knows its own pose, and goes on while it sees no tag."""

    kind: Annotated[str, OneOf(DEAD_RECKONING), "Estimator."] = "control_integration"


@settings
class PickAndPlaceScenario(CableRobotSettings, ScenarioHeader):
    """One run of a robot that looks for a box, takes it, and sets it down at a goal."""

    kind: Annotated[str, OneOf((PICK_AND_PLACE,)), "Kind of run."]
    initial_pose: Annotated[Pose, "Pose of the platform in W at time 0."]
    workpiece: Annotated[WorkpieceSettings, "The box."]
    goal: Annotated[GoalSettings, "Where it is to go."]
    scatter: Annotated[ScatterSettings, "How far both truly are from there."] = filled(
        ScatterSettings
    )
    gripper: Annotated[GripperSettings, "The gripper."] = filled(GripperSettings)
    camera: Annotated[BoxCameraSettings, "The cameras."] = filled(BoxCameraSettings)
    goal_camera: Annotated[
        GoalCameraSettings | None,
        "A second camera, which looks at the goal; null: the first one looks at both.",
    ] = None
    cover: Annotated[CoverSettings | None, "What hides a tag for a while; null: nothing does."] = (
        None
    )
    handling: Annotated[HandlingSettings, "The servo, and when phases end."] = filled(
        HandlingSettings
    )
    estimator: Annotated[DeadReckoning, "Dead reckoning."] = filled(DeadReckoning)
    sensors: Annotated[SensorSettings, "Sensors of dead reckoning."] = filled(SensorSettings)
    perturbations: Annotated[HandlingErrors, "Model errors."] = filled(HandlingErrors)
    integration: Annotated[PlantIntegration, "Integration."] = filled(PlantIntegration)
    log_rate: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "Rows of the log per second."] = 50.0

    def places(self) -> tuple[RigidTransform, RigidTransform]:
        """True poses of box and goal at time 0, X_WB and X_WG [m], by the seed."""
        random = np.random.default_rng([self.seed, PLACES])
        first, second = (
            self._scattered(pose.transform(), random)
            for pose in (self.workpiece.pose, self.goal.pose)
        )
        return first, second

    def _scattered(self, X_WB: RigidTransform, random: np.random.Generator) -> RigidTransform:
        radius = self.scatter.distance * np.sqrt(random.uniform())
        way, turn = random.uniform(-np.pi, np.pi), random.uniform(-1.0, 1.0)
        angle = np.radians(self.scatter.angle_deg) * turn
        shift = RigidTransform([radius * np.cos(way), radius * np.sin(way), 0.0])
        c, s = np.cos(angle), np.sin(angle)
        R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        turned = RigidTransform(X_WB.rotation(), np.zeros(3))
        about = RigidTransform(X_WB.translation())
        return shift @ about @ RigidTransform(pose=np.column_stack([R, np.zeros(3)])) @ turned


PLACES = 104_729
"""Stream of random numbers of a seed for the places of box and goal."""


def pick_and_place_refusals(scope: Scope) -> Iterator[Refusal]:
    """What cannot be done with a box."""
    scenario, robot = scope.whole, scope.robot
    if scenario.failures is not None:
        accepted = f"null, or kind {VISUAL_SERVO}"
        yield "failures", f"some with kind {PICK_AND_PLACE}", accepted
    if not robot.motion_type().is_free:
        yield "robot", f"{robot.name}, {robot.motion}", "one that moves freely, 3R3T"
    if scenario.world is None or scenario.world.contact is None:
        found = "null, so the box would fall through everything"
        yield "world.contact", found, "{} or more of the section"
    mounts = [mount.name for mount in robot.cameras if mount.parent == "platform"]
    if scenario.camera.mount not in mounts:
        found = f"{scenario.camera.mount!r}, which is not on the platform of {robot.name}"
        yield "camera.mount", found, f"one of {', '.join(mounts)}"
    flat = {"workpiece.pose": scenario.workpiece.pose, "goal.pose": scenario.goal.pose}
    for key, pose in flat.items():
        if float(np.max(np.abs(pose.angles_deg[:2]))) > LEVEL:
            accepted = "0, 0, any angle: the box lies flat"
            yield f"{key}.angles_deg", pose.angles_deg.tolist(), accepted
    poses = {"initial_pose": scenario.initial_pose, **flat}
    lower, upper = robot.frame.bounds()
    for key, pose in poses.items():
        if np.any(pose.position < lower) or np.any(pose.position > upper):
            accepted = f"within the frame, {lower.tolist()} to {upper.tolist()} [m]"
            yield f"{key}.position", pose.position.tolist(), accepted
    yield from _tags(scenario)
    if scenario.winches.kind != "ideal":
        yield "winches.kind", scenario.winches.kind, "ideal"
    limit = scenario.handling.phase_limit
    if scenario.cover is not None and scenario.cover.duration >= limit:
        found = f"{scenario.cover.duration:g} s"
        yield "cover.duration", found, f"shorter than handling.phase_limit, {limit:g} s"
    start = scenario.initial_pose.transform()
    yield from world_refusals(scenario.world, robot, start, compiled=False, stop=False)


def _tags(scenario: PickAndPlaceScenario) -> Iterator[Refusal]:
    box, goal = scenario.workpiece, scenario.goal
    if box.tag.tag_id == goal.tag.tag_id:
        yield "goal.tag.tag_id", f"{goal.tag.tag_id}, that of the box", "another"
    half, edge = 0.5 * box.size[:2], 0.625 * box.tag.size
    if np.any(np.abs(box.tag.position) + edge > half):
        found = (
            f"{box.tag.position.tolist()}, where the tag with its white rim, "
            f"{1.25 * box.tag.size:g} m wide, is not on the box's upper face"
        )
        accepted = f"within {(half - edge).tolist()} m of its middle"
        yield "workpiece.tag.position", found, accepted
    if np.all(np.abs(goal.tag.position) - 0.625 * goal.tag.size < half):
        found = f"{goal.tag.position.tolist()}, where the box lies on the tag once it is set down"
        yield "goal.tag.position", found, "beside the box"
