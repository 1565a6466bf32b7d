"""A log of which one reading in twenty is bad, calibrated from many first poses.

As a script it says how many starts end in the right minimum, and how many in others, with or
without a word of it: `python -m tests.analyses.fits.spoiled_log --count 200`.
"""

import argparse
from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.fits.calibration import fit_robot
from cdpr_drake.analyses.fits.robots import calibration_model
from cdpr_drake.analyses.fits.setup import CalibrationTask, Sigmas
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot

ROBOT = load_robot("acrobot_small")
SIGMAS = Sigmas(lengths=2e-4, swivels=3e-3)
COUNT, SHARE = 10, 0.05
BAD = (10.0, 300.0)
"""Bad readings are off by so many sigmas, either way."""

FAR = 6.0
"""Poses that are more of their standard deviations off are wrong."""


def spoiled(values, sigma, random):
    """With bad readings, none in the first row, from which all count; and how many."""
    hit = random.uniform(size=values.shape) < SHARE
    hit[0] = False
    size = sigma * random.uniform(*BAD, values.shape) * random.choice([-1, 1], values.shape)
    return np.where(hit, values + size, values), int(np.sum(hit))


@cache
def recorded():
    """The poses, the log of lengths and swivel angles that count from the first, bad readings."""
    random, model = np.random.default_rng([0, 5]), calibration_model(ROBOT)
    poses = [
        pose_from_angles(
            np.append(random.uniform(-0.2, 0.2, 2), random.uniform(0.2, 0.6)),
            random.uniform(-0.3, 0.3, 3),
        )
        for _ in range(COUNT)
    ]
    numbers = Point(model, Stations.at(poses)).numbers
    shape = numbers.shape[:2]
    lengths = numbers[:, :, 0] + SIGMAS.lengths * random.standard_normal(shape)
    angles = numbers[:, :, 2] + SIGMAS.swivels * random.standard_normal(shape)
    counted, bad = spoiled(lengths - lengths[0], SIGMAS.lengths, random)
    turned, more = spoiled(angles - angles[0], SIGMAS.swivels, random)
    log = Measurements(Path("spoiled"), COUNT, lengths=counted, swivels=turned)
    return poses, log, bad + more


def first_pose(number):
    """Where the platform is believed to begin: up to a quarter of the frame and 0.4 rad off."""
    random, poses = np.random.default_rng([number, 77]), recorded()[0]
    low, high = np.asarray(ROBOT.frame.lower), np.asarray(ROBOT.frame.upper)
    place = poses[0].translation() + 0.25 * (high - low) * random.uniform(-1, 1, 3)
    turn = pose_from_angles(np.zeros(3), random.uniform(-0.4, 0.4, 3)).rotation()
    return RigidTransform(turn, np.clip(place, low, high))


def calibrated(start, log=None):
    """The calibration from a first pose, of this log or another."""
    task = CalibrationTask(
        robot=ROBOT, log=recorded()[1] if log is None else log, unknown=("length_offsets",),
        sigmas=SIGMAS, start=start, rest=False,
    )  # fmt: skip
    return fit_robot(task)


def wrong_rows(found):
    """Rows whose pose is not where it truly was, from 0."""
    rows = []
    for k, (X, Y) in enumerate(zip(recorded()[0], found.result.stations.poses(), strict=True)):
        (distance, angle), (turn, place) = pose_error(X, Y), found.result.pose_std[k]
        if distance > FAR * place or angle > FAR * turn:
            rows.append(k)
    return rows


def outcome(number):
    """How a calibration ends, in words."""
    try:
        found = calibrated(first_pose(number))
    except CdprError as problem:
        return f"refused: {problem}"
    rows = wrong_rows(found)
    if not rows:
        return "right"
    if found.misfit:
        return "misfit"
    told = {tie.pose for tie in found.ties}
    return "wrong, told that there are two" if set(rows) <= told else "WRONG"


def main():
    """Counts how starts end."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    count = parser.parse_args().count
    print(f"{recorded()[2]} bad readings of {2 * 8 * COUNT}")
    print(dict(Counter(outcome(number) for number in range(count))))


if __name__ == "__main__":
    main()
