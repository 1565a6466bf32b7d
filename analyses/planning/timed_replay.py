"""The replay of a motion among what moves, in which that moves, too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydrake.geometry import Capsule, Convex, Shape, Sphere
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.planning.timed_plan_results import TimedRun
from cdpr_drake.analyses.visualization.replay import write_replay
from cdpr_drake.analyses.visualization.shown_things import ShownThing, Surroundings
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.geometry.poses import pose_row

RATE = 30.0
"""Frames a second [Hz]."""

AFTER = 1.0
"""How long what moves is shown after the platform has arrived [s]."""

RESTS, MOVES = (0.55, 0.55, 0.55, 1.0), (0.72, 0.55, 0.38, 1.0)
"""Colours of obstacles."""


def write_timed_replay(path: Path, run: TimedRun) -> None:
    """Writes the motion with all obstacles as a page that opens without a server."""
    end = run.motion.end_time
    times = np.arange(0.0, min(end + AFTER, run.sets.horizon), 1.0 / RATE)
    samples = run.samples
    tensions = np.column_stack([np.interp(times, samples.times, one) for one in samples.tensions.T])
    log: dict[str, Array] = {
        "time": times,
        "X_WP": np.array([pose_row(run.motion.pose(float(t))) for t in times]),
        "tensions": tensions,
    }
    things = []
    for number, one in enumerate(run.sets.about["obstacles"]):
        shape = ConvexShape(np.array(one["points_m"]), one["radius_m"])
        things.append(_shown(f"obstacle_{number}", shape, RESTS, None))
    for number, moving in enumerate(run.things):
        for k, (shape, poses) in enumerate(moving.shown(times)):
            name = f"moving_{number}_{k}"
            log[name] = np.array([pose_row(X) for X in poses])
            things.append(_shown(name, shape, MOVES, name))
    write_replay(path, run.robot, log, around=Surroundings(things=tuple(things)), title=run.about)


def _shown(
    name: str, shape: ConvexShape, color: tuple[float, float, float, float], quantity: str | None
) -> ShownThing:
    solid, X = drake_shape(shape)
    return ShownThing(name, solid, color, X, quantity)


def drake_shape(shape: ConvexShape) -> tuple[Shape, RigidTransform]:
    """A convex shape as Drake has it, and its pose; one that is round and no ball or capsule is
    shown, and taken, without its radius."""
    points = shape.points
    if len(points) == 1:
        return Sphere(shape.radius), RigidTransform(points[0])
    if len(points) == 2:
        way = points[1] - points[0]
        R = RotationMatrix.MakeFromOneVector(way, 2)
        X = RigidTransform(R, 0.5 * (points[0] + points[1]))
        return Capsule(max(shape.radius, 1e-4), float(np.linalg.norm(way))), X
    return Convex(points.T, shape.name or "hull"), RigidTransform()
