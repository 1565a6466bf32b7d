"""A run whose log is written by hand, so that what is made of it can be worked out on paper."""

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome

TIMES = np.array([0.0, 0.5, 1.5, 3.5])
"""Of the rows; no two are equally far apart [s]."""

FOUND = np.array([True, False, True, True])
SEEN = np.array([[100.0, 50.0], [0.0, 0.0], [200.0, 110.0], [320.0, 300.0]])
"""Image of the target's middle in each row [px]; zero where it is not found."""

ESTIMATE_OFF = np.array([0.001, 0.004, 0.002, 0.003])
"""Distance of the estimate from the truth [m]."""

ESTIMATE_TURNED = np.array([0.01, 0.02, 0.05, 0.04])
"""Angle of the estimate from the truth [rad]."""

PLAN_OFF, PLAN_TURNED = np.array([0.01, 0.03, 0.02, 0.02]), np.array([0.2, 0.1, 0.15, 0.15])
"""The same of the plan [m], [rad]."""


def platform_poses():
    """Four poses near home, no two with the same rotation or on a line."""
    angles = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, -0.2, 0.0], [0.05, -0.1, 0.3]]
    places = [[0.1, -0.03, 0.30], [0.12, -0.05, 0.28], [0.15, -0.1, 0.25], [0.2, -0.12, 0.2]]
    return [RigidTransform(RollPitchYaw(a), p) for a, p in zip(angles, places, strict=True)]


def rows(poses):
    return np.array([pose_row(X) for X in poses])


def poses_off(distances, angles):
    """Rows of poses that are so far from the platform's along y, and turned about their x axes."""
    return rows(
        RigidTransform(
            X.rotation() @ RollPitchYaw(angle, 0.0, 0.0).ToRotationMatrix(),
            X.translation() + np.array([0.0, distance, 0.0]),
        )
        for X, distance, angle in zip(platform_poses(), distances, angles, strict=True)
    )


def run_by_hand(name="acrobot_pbvs", *settings):
    """A run with that log of a scenario that is built and not simulated."""
    run = ServoRun(load_scenario(name, ["camera.kind=projected", *settings]))
    servo = run.built
    m, pinhole = len(servo.robot.cables), servo.pinhole
    X_CO = [
        RigidTransform(
            RollPitchYaw(np.pi, 0.0, 0.0),
            [(u - pinhole.cx) / pinhole.fx * z, (v - pinhole.cy) / pinhole.fy * z, z],
        )
        for (u, v), z in zip(SEEN, (0.5, 0.4, 0.3, 0.2), strict=True)
    ]
    rng = np.random.default_rng(1)
    tensions = rng.uniform(2.0, 50.0, (4, m))
    tensions[1, 2], tensions[2, 5] = 0.0, 57.5
    slack = np.zeros((4, m))
    slack[0, 1] = slack[1, 2] = slack[1, 3] = slack[3, 4] = 1.0
    run.log = {
        "time": TIMES,
        "found": FOUND[:, None].astype(float),
        "gain": np.array([[0.5], [0.0], [0.4], [0.3]]),
        "error": rng.uniform(-1.0, 1.0, (4, 6)),
        "corners_px": np.array([pinhole.project(X @ servo.target.points).T.ravel() for X in X_CO]),
        "X_CO_measured": rows(X_CO),
        "X_WP": rows(platform_poses()),
        "X_WP_estimated": poses_off(ESTIMATE_OFF, ESTIMATE_TURNED),
        "tensions": tensions,
        "slack": slack,
        "surplus_lengths": 0.01 * slack,
        "cable_velocities": rng.uniform(-0.1, 0.1, (4, m)),
    }
    run.outcome, run.message = Outcome.TIMEOUT, "slow"
    run.sim_time, run.wall_time = 3.5, 0.5
    return run


def changed(run, log=None, **attributes):
    """The run with other quantities and attributes, and nothing that was computed of it."""
    other = ServoRun(run.scenario)
    names = ("built", "broken", "outcome", "message", "sim_time", "wall_time")
    same = {name: getattr(run, name) for name in names}
    for name, value in {**same, **attributes, "log": {**run.log, **(log or {})}}.items():
        setattr(other, name, value)
    return other
