"""Simulated logs of winches, swivel angles and trackers: as arrays, and as files for commands."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

import cdpr_drake as cdpr
from cdpr_drake.analyses.fits.calibration import fit_robot
from cdpr_drake.analyses.fits.robots import calibration_model
from cdpr_drake.analyses.fits.setup import CalibrationTask, Sigmas
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.calibration.guesses import with_tags
from cdpr_drake.calibration.measurements import simulated_lengths, simulated_poses
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_error, pose_from_angles, pose_row
from cdpr_drake.models.robot_loader import load_robot
from tests.cli.commands import write_log

ROBOT, SIGMAS = load_robot("acrobot_small"), Sigmas(lengths=1e-4, place=2e-4, turn=5e-4)
COUNT = 16
POSE_NAMES = ("qw", "qx", "qy", "qz", "x_m", "y_m", "z_m")


def random_poses(random, count):
    """Poses near the middle of the frame."""
    return [
        pose_from_angles(
            np.append(random.uniform(-0.2, 0.2, 2), random.uniform(0.2, 0.6)),
            random.uniform(-0.3, 0.3, 3),
        )
        for _ in range(count)
    ]


def poses(count=COUNT):
    return random_poses(np.random.default_rng(0), count)


def numbers(model, poses):
    """Lengths, and as the last of three columns swivel angles, of all cables, shape (k, m, 3)."""
    return Point(model, Stations.at(poses)).numbers


def inclinations(poses):
    """Roll, pitch and yaw, shape (k, 3) [rad]."""
    return np.array([RollPitchYaw(X.rotation()).vector() for X in poses])


def errors(poses, result):
    """Distances and angles from where the platform was to where it is found, shape (k, 2)."""
    pairs = zip(poses, result.stations.poses(), strict=True)
    return np.array([pose_error(X, Y) for X, Y in pairs])


def fitted(robot, log, unknown, **more):
    """A calibration of a log."""
    return fit_robot(CalibrationTask(robot=robot, log=log, unknown=unknown, **more))


def recorded(true, *, count=COUNT):
    """What winches and a tracker would measure with noise of these sigmas."""
    random, at = np.random.default_rng(1), poses(count)
    readings = simulated_lengths(true, at, numbers(true, at)[0, :, 0], SIGMAS.lengths, random)
    tracked = simulated_poses(at, SIGMAS.turn, SIGMAS.place, random, true)
    return Measurements(Path("simulated"), count, lengths=readings, poses=list(tracked))


def tracked_fit(unknown, log, priors=None, **more):
    """A calibration whose first pose is believed some centimetres off."""
    start = poses()[0]
    off = RigidTransform(start.rotation(), start.translation() + np.array([0.02, -0.01, 0.01]))
    more = {"priors": priors or {}, "sigmas": SIGMAS, "start": off, **more}
    return fitted(ROBOT, log, unknown, **more)


# Files.

TAGS = {
    k: pose_from_angles(np.array([x, y, 0.0]), np.zeros(3))
    for k, (x, y) in enumerate([(-0.15, -0.1), (-0.15, 0.1), (0.1, -0.1), (0.1, 0.1)])
}
TRUE = with_tags(calibration_model(ROBOT, "onboard"), TAGS)
POSES = poses(20)
START = numbers(TRUE, POSES[:1])[0, :, 0]
MOTION_NOISE = {"tension": 0.3, "place": 1e-4, "angle": 2e-4}


def length_columns(readings):
    return {f"C{i + 1}_length_m": readings[:, i] for i in range(8)}


def pose_columns(poses):
    return dict(zip(POSE_NAMES, np.array([pose_row(X) for X in poses]).T, strict=True))


def tracked_columns(seed, poses=POSES, tracked=None):
    """Winches and a tracker at poses; the tracker at others if these are not None."""
    random = np.random.default_rng(seed)
    readings = simulated_lengths(TRUE, poses, START, 1e-4, random)
    at = poses if tracked is None else tracked
    return length_columns(readings) | pose_columns(simulated_poses(at, 1e-3, 5e-4, random))


def pushed_columns(believed):
    """Lengths and positions of a point mass whose exit points were pushed aside by 10 mm."""
    random, moves = np.random.default_rng(0), believed.motion == "3T"
    aside = 0.01 * random.standard_normal((len(believed.cables), 3)) * (1.0 if moves else [1, 0, 1])
    cables = [
        replace(cable, exit_point=cable.exit_point + step)
        for cable, step in zip(believed.cables, aside, strict=True)
    ]
    corners = np.array([cable.exit_point for cable in believed.cables])
    low, high = corners.min(axis=0), corners.max(axis=0)
    places = low + random.uniform(0.1, 0.7, (30, 3)) * (high - low)
    if not moves:
        places[:, 1] = believed.home.position[1]
    at = [pose_from_angles(place, np.zeros(3)) for place in places]
    lengths = numbers(calibration_model(replace(believed, cables=cables)), at)[:, :, 0]
    lengths = lengths + 1e-3 * random.standard_normal(lengths.shape)
    names = [f"{cable.name}_length_m" for cable in believed.cables]
    return dict(zip([*names, "x_m", "y_m", "z_m"], [*lengths.T, *places.T], strict=True))


def write_motion(path, time, poses, tensions):
    """A log with columns as `cdpr simulate` names them."""
    header = ["time_s", *(f"X_WP.{name}" for name in POSE_NAMES)]
    header += [f"measured_tensions.C{i + 1}_n" for i in range(tensions.shape[1])]
    return write_log(path, dict(zip(header, [time, *poses.T, *tensions.T], strict=True)))


def write_planar(path):
    """Exact lengths and poses of `planar` whose first exit point is 5 mm off."""
    true, random = load_robot("planar"), np.random.default_rng(0)
    true.cables[0].exit_point = true.cables[0].exit_point + np.array([0.005, 0.0, 0.0])
    header = ["time_s", *(f"{cable.name}_length_m" for cable in true.cables)]
    header += ["x_m", "y_m", "z_m", "phi_deg", "theta_deg", "psi_deg"]
    rows = []
    for k in range(12):
        place = np.append(random.uniform(-0.15, 0.15, 2), true.plane_height)
        angles = np.array([0.0, 0.0, random.uniform(-8.0, 8.0)])
        X_WP = cdpr.Pose(position=place, angles_deg=angles).transform()
        rows.append([k, *cable_paths(X_WP, true.cable_set()).lengths, *place, *angles])
    write_log(path, dict(zip(header, np.array(rows).T, strict=True)))
    return path


# A log of which one reading in twenty is bad, calibrated from many first poses.

BLIND = Sigmas(lengths=2e-4, swivels=3e-3)
BLIND_COUNT, BAD_SHARE = 10, 0.05
BAD = (10.0, 300.0)
"""Bad readings are off by so many sigmas, either way."""

FAR = 6.0
"""Poses that are more of their standard deviations off are wrong."""


def _with_bad(values, sigma, random):
    """With bad readings, none in the first row, from which all count; and how many."""
    hit = random.uniform(size=values.shape) < BAD_SHARE
    hit[0] = False
    size = sigma * random.uniform(*BAD, values.shape) * random.choice([-1, 1], values.shape)
    return np.where(hit, values + size, values), int(np.sum(hit))


@cache
def spoiled():
    """The poses, the log of lengths and swivel angles that count from the first, bad readings."""
    random = np.random.default_rng([0, 5])
    at = random_poses(random, BLIND_COUNT)
    true = numbers(calibration_model(ROBOT), at)
    lengths = true[:, :, 0] + BLIND.lengths * random.standard_normal(true.shape[:2])
    angles = true[:, :, 2] + BLIND.swivels * random.standard_normal(true.shape[:2])
    counted, bad = _with_bad(lengths - lengths[0], BLIND.lengths, random)
    turned, more = _with_bad(angles - angles[0], BLIND.swivels, random)
    log = Measurements(Path("spoiled"), BLIND_COUNT, lengths=counted, swivels=turned)
    return at, log, bad + more


def first_pose(number):
    """Where the platform is believed to begin: up to a quarter of the frame and 0.4 rad off."""
    random, at = np.random.default_rng([number, 77]), spoiled()[0]
    low, high = np.asarray(ROBOT.frame.lower), np.asarray(ROBOT.frame.upper)
    place = at[0].translation() + 0.25 * (high - low) * random.uniform(-1, 1, 3)
    turn = pose_from_angles(np.zeros(3), random.uniform(-0.4, 0.4, 3)).rotation()
    return RigidTransform(turn, np.clip(place, low, high))


def blind_fit(start):
    """The calibration of the spoiled log from a first pose."""
    more = {"sigmas": BLIND, "start": start, "rest": False}
    return fitted(ROBOT, spoiled()[1], ("length_offsets",), **more)


def wrong_rows(calibration):
    """Rows whose pose is not where it truly was, from 0."""
    off, std = errors(spoiled()[0], calibration.result), calibration.result.pose_std[:, ::-1]
    return np.flatnonzero(np.any(off > FAR * std, axis=1)).tolist()
