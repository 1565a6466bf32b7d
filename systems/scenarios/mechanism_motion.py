"""What waypoints of a scenario mean to a plant: its wanted motion."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointIndex, QuaternionFloatingJoint

from cdpr_drake.arrays import Array
from cdpr_drake.errors import RobotFileError, ScenarioError
from cdpr_drake.models.mechanism_in_plant import one_of
from cdpr_drake.models.plant_rest import scoped_joint
from cdpr_drake.systems.scenarios.mechanism_scenario import Waypoint
from cdpr_drake.trajectories.plant_motion import PlantMotion

PLAIN_JOINTS = ("revolute", "prismatic", "screw", "planar", "universal")
"""Joints whose velocities are the rates of their positions, so that a waypoint may move them."""


def moving_joints(plant: MultibodyPlant) -> list[Any]:
    """The joints of a plant that move, those of free bodies among them, in their order."""
    joints = (plant.get_joint(JointIndex(i)) for i in plant.GetJointIndices())
    return [joint for joint in joints if joint.num_velocities()]


def plant_motion(plant: MultibodyPlant, start: Array, waypoints: list[Waypoint]) -> PlantMotion:
    """The motion of a plant from positions at time 0 through waypoints.

    Args:
        plant: The plant, finalized.
        start: Positions at time 0, shape (nq,).
        waypoints: The waypoints, their times growing.

    Raises:
        ScenarioError: A joint or body is not there or cannot be moved so, or a position is beyond
            the joint's limits; names the key, without the file.
    """
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, start)
    free = plant.GetFloatingBaseBodies()
    joints, bodies = {}, {}
    for joint in moving_joints(plant):
        if isinstance(joint, QuaternionFloatingJoint) and joint.child_body().index() in free:
            bodies[joint.child_body().scoped_name().get_full()] = joint.child_body()
        else:
            joints[scoped_joint(plant, joint)] = joint
    rows = [np.array(start, dtype=float)]
    for k, waypoint in enumerate(waypoints):
        key = f"motion.waypoints[{k}]"
        for name, values in waypoint.joints.items():
            joint = joints[_known(joints, name, f"{key}.joints.{name}")]
            _check_joint(joint, values, f"{key}.joints.{name}")
            q = np.array(plant.GetPositions(context))
            q[joint.position_start() : joint.position_start() + len(values)] = values
            plant.SetPositions(context, q)
        for name, pose in waypoint.bodies.items():
            body = bodies[_known(bodies, name, f"{key}.bodies.{name}")]
            plant.SetFreeBodyPose(context, body, pose.transform())
        rows.append(np.array(plant.GetPositions(context)))
    times = np.array([0.0, *(waypoint.time for waypoint in waypoints)])
    velocity_rows, quaternions = np.full(plant.num_positions(), -1), []
    for joint in moving_joints(plant):
        first, velocity, n = joint.position_start(), joint.velocity_start(), joint.num_velocities()
        if isinstance(joint, QuaternionFloatingJoint):
            quaternions.append((first, velocity))
            velocity_rows[first + 4 : first + 7] = velocity + 3 + np.arange(3)
        else:  # of what is no plain joint all positions stay, and so all rates are zero
            velocity_rows[first : first + n] = velocity + np.arange(n)
    return PlantMotion(times, np.array(rows), velocity_rows, quaternions)


def _known(names: dict[str, Any], name: str, key: str) -> str:
    try:
        return one_of(names, name)
    except RobotFileError as problem:
        raise ScenarioError(f"{key}: {problem}") from problem


def _check_joint(joint: Any, values: Array, key: str) -> None:
    """Refuses what a waypoint cannot ask of a joint."""
    n, kind = joint.num_positions(), joint.type_name()
    if kind not in PLAIN_JOINTS:
        raise ScenarioError(
            f"{key}: found a joint of the type {kind}; accepted: {', '.join(PLAIN_JOINTS)}"
        )
    if len(values) != n:
        raise ScenarioError(f"{key}: found {len(values)} numbers; accepted: {n} [rad, m]")
    low, high = joint.position_lower_limits(), joint.position_upper_limits()
    if np.any(values < low) or np.any(values > high):
        words = ", ".join(f"{value:g}" for value in values)
        limits = " and ".join(f"{a:g}..{b:g}" for a, b in zip(low, high, strict=True))
        raise ScenarioError(f"{key}: found {words}; accepted: within the joint's limits, {limits}")
