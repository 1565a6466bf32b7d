"""Refusals of a robot as a whole; those of single sections are in their classes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.cables.cable_behaviour import behaving_cables
from cdpr_drake.cables.models import CABLE_MODELS, check_model
from cdpr_drake.errors import CableModelError
from cdpr_drake.geometry.motion_type import across
from cdpr_drake.geometry.straight_cables import cable_lengths
from cdpr_drake.schema.declarations import Refusal, number_words, repeated

if TYPE_CHECKING:
    from cdpr_drake.models.robot_schema import Robot

SHORTEST_CABLE = 1e-3
"""A cable shorter than this [m] at the home pose counts as an exit point on an anchor point."""

ALIGNED = 1e-9
"""How far a turn, or a point of a beam relative to its reach, may be off an axis."""


def robot_refusals(robot: Robot) -> Iterator[Refusal]:
    """What a robot refuses in addition to its sections."""
    yield from repeated((cable.name for cable in robot.cables), "cables[{}].name")
    yield from repeated((mount.name for mount in robot.cameras), "cameras[{}].name")
    slack, m = robot.slack_readings, len(robot.cables)
    if slack is not None and len(slack) != m:
        found = f"{len(slack)} numbers"
        yield "slack_readings", found, f"one for each of the {m} cables [N]"
    home, (lower, upper) = robot.home.position, robot.frame.bounds()
    if np.all(lower < upper) and (np.any(home < lower) or np.any(home > upper)):
        within = f"within the frame, {number_words(lower)} to {number_words(upper)}"
        yield "home.position", number_words(home), within
    yield from _motion(robot)
    if not m:
        yield "cables", "none", "at least one cable"
        return
    diameters = robot.diameters()
    for k, leader in enumerate(robot.winch_groups().leaders()):
        if diameters[k] != diameters[leader]:
            found = f"{diameters[k]:g} on the winch {robot.cables[k].winch}"
            one = f"that of {robot.cables[leader].name} on the same winch"
            yield f"cables[{k}].material.diameter", found, f"{diameters[leader]:g} [m], {one}"
    X_WP, exits, anchors = robot.home.transform(), robot.exit_points(), robot.anchor_points()
    for k, length in enumerate(cable_lengths(X_WP, exits, anchors)):
        if length < SHORTEST_CABLE:
            exit, anchor = number_words(exits[:, k]), number_words(anchors[:, k])
            found = f"exit point {exit} on anchor point {anchor} of {robot.cables[k].name} at home"
            yield f"cables[{k}]", found, f"points at least {SHORTEST_CABLE:g} m apart there"
    if robot.cable_model is not None:
        cables = robot.cable_set()
        if CABLE_MODELS[robot.cable_model].sags:
            cables = behaving_cables(cables, robot.cable_behaviour())
        try:
            check_model(robot.cable_model, cables)
        except CableModelError as problem:
            yield "cable_model", str(problem), ""


def _motion(robot: Robot) -> Iterator[Refusal]:
    """A platform, a plane or a line that the motion type cannot have."""
    if robot.axis is not None and robot.motion in ("3T", "3R3T"):
        yield "axis", number_words(robot.axis), f"null for {robot.motion}"
        return
    motion = robot.motion_type()
    is_level = motion.is_plane and motion.axis == (0.0, 0.0, 1.0)
    height = robot.plane_height
    if (height is None and robot.motion == "2T1R") if is_level else height is not None:
        accepted = "a height for robots in a horizontal plane, null for others"
        yield "plane_height", "null" if height is None else height, accepted
    if motion.num_turns == 1:
        R = robot.home.transform().rotation().matrix()
        if np.linalg.norm(R @ motion.axis - motion.axis) > ALIGNED:
            normal = number_words(np.array(motion.axis))
            found = number_words(robot.home.angles_deg)
            yield "home.angles_deg", found, f"a turn about the plane's normal {normal}"
    if motion.is_point:
        yield from _point(robot)
    ends = [cable.anchor_pulley_radius or 0.0 for cable in robot.cables]
    ends += [0.0 if robot.platform_pulley is None else robot.platform_pulley.radius]
    others = [robot.pulley.radius, *(cable.pulley_radius or 0.0 for cable in robot.cables)]
    if robot.pulley.arm > 0.0 and max(*ends, *others) > 0.0:
        found = f"{robot.pulley.arm:g} with pulleys"
        yield "pulley.arm", found, "0, or no pulleys at either end"
    if max(ends) > 0.0 and (motion.is_point or robot.motion == "2R3T"):
        found = f"pulleys at the platform of {robot.motion}"
        accepted = "none there, since a cable over one pulls beside Po or the beam"
        yield "platform_pulley", found, accepted
    if robot.platform.hysteresis and (motion.is_point or robot.motion == "2R3T"):
        accepted = "null, or a body in space or in a plane: 3R3T, 2T1R, 1R2T"
        yield "platform.hysteresis", f"a section for {robot.motion}", accepted
    if robot.motion == "2R3T":
        yield from _beam(robot, np.array(motion.axis))


def _point(robot: Robot) -> Iterator[Refusal]:
    """A point mass is held in Po."""
    points = {f"cables[{k}].anchor_point": one.anchor_point for k, one in enumerate(robot.cables)}
    points["platform.center_of_mass"] = robot.center_of_mass()
    for key, point in points.items():
        if np.any(point):
            yield key, number_words(point), f"Po, 0 0 0, of a point mass, {robot.motion}"


def _beam(robot: Robot, axis: Array) -> Iterator[Refusal]:
    """A beam is held on its axis, and turns about it as any body of revolution."""
    points = {f"cables[{k}].anchor_point": one.anchor_point for k, one in enumerate(robot.cables)}
    reach = max((float(np.linalg.norm(point)) for point in points.values()), default=0.0)
    points["platform.center_of_mass"] = robot.center_of_mass()
    where = f"a point of the beam's axis, through Po along {number_words(axis)}"
    for key, point in points.items():
        if np.linalg.norm(np.cross(axis, point)) > ALIGNED * max(reach, 1e-6):
            yield key, number_words(point), where
    inertia = robot.platform.rotational_inertia()
    e, f = across(axis).T
    off = [np.linalg.norm(np.cross(axis, inertia @ axis)),
           abs(e @ inertia @ e - f @ inertia @ f) + abs(e @ inertia @ f)]  # fmt: skip
    if max(off) > ALIGNED * np.trace(inertia):
        accepted = f"that of a body of revolution about {number_words(axis)}; its spin is no matter"
        yield "platform.inertia", "one that differs about the beam", accepted
