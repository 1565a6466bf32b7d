"""Simulated logs of winches and a tracker: shared by tests of calibrations from logs."""

from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.fits.setup import CalibrationTask, Sigmas
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.calibration.measurements import simulated_lengths, simulated_poses
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot

ROBOT, SIGMAS = load_robot("acrobot_small"), Sigmas(lengths=1e-4, place=2e-4, turn=5e-4)
COUNT = 16


def poses(count=COUNT):
    """Poses near the middle of the frame."""
    random = np.random.default_rng(0)
    return [
        pose_from_angles(
            np.append(random.uniform(-0.2, 0.2, 2), random.uniform(0.2, 0.6)),
            random.uniform(-0.3, 0.3, 3),
        )
        for _ in range(count)
    ]


def recorded(true, *, count=COUNT, noise=1.0):
    """What winches and a tracker would measure, with noise in parts of the sigmas."""
    random, at = np.random.default_rng(1), poses(count)
    start = Point(true, Stations.at(at[:1])).numbers[0, :, 0]
    readings = simulated_lengths(true, at, start, noise * SIGMAS.lengths, random)
    seen = simulated_poses(at, noise * SIGMAS.turn, noise * SIGMAS.place, random, true)
    return Measurements(Path("simulated"), count, lengths=readings, poses=list(seen))


def task(unknown, log, priors=None, **more):
    """A task whose first pose is believed some centimetres off."""
    start = poses()[0]
    place = start.translation() + np.array([0.02, -0.01, 0.01])
    off = RigidTransform(start.rotation(), place)
    return CalibrationTask(
        robot=ROBOT, log=log, unknown=unknown, priors=priors or {}, sigmas=SIGMAS, start=off, **more
    )
