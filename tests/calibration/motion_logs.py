"""Synthetic logs of point masses and of bodies in planes, and chi-square of their calibrations.

As a script it prints chi-square over many logs:
`python -m tests.calibration.motion_logs --count 1000`.
"""

import argparse
from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.calibration.parameters import CalibrationModel, model_difference
from cdpr_drake.calibration.program import CalibrationProgram
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_type import MotionType, across
from cdpr_drake.geometry.poses import rotation_from_vector

LENGTHS, PLACE, TURN = 1e-3, 5e-4, 1e-3
"""Standard deviations of lengths [m], and of a tracker [m, rad]."""

COUNT, BELIEVED = 14, 0.01
"""Poses of a log, and by how much exit points are off where a search begins [m]."""

MOTIONS = {
    "point in space": MotionType("3T"),
    "body in an upright plane": MotionType("2T1R", (0.0, 1.0, 0.0)),
    "point in an oblique plane": MotionType("2T", (1.0, 2.0, 2.0)),
    "point on an oblique line": MotionType("1T", (2.0, 1.0, 2.0)),
}
"""What moves, by its name."""


def true_model(motion):
    """Four cables round the place where the platform moves: in its plane, if it moves in one."""
    corners = np.array([[-1.0, -1.2, 1.0, 1.1], [-1.0, 1.1, 1.05, -0.95]])
    if motion.is_plane:
        p_WA = across(np.asarray(motion.axis)) @ corners
        arms = across(np.asarray(motion.axis)) @ (0.05 * np.sign(corners) * [[1.0], [0.5]])
    else:
        p_WA = np.vstack([corners, [0.9, -0.2, 1.1, -0.3]])
        arms = 0.05 * np.sign(p_WA)
    if motion.is_point:
        arms = np.zeros((3, 4))
    return CalibrationModel(("C1", "C2", "C3", "C4"), CableSet.make(p_WA, arms, 1e5))


def poses(motion, random, count=COUNT):
    """Poses that the motion type has."""
    B, found = motion.basis(np.eye(3)), []
    for _ in range(count):
        step = B @ np.concatenate([
            random.uniform(-0.3, 0.3, motion.num_turns), random.uniform(-0.5, 0.5, motion.num_moves)
        ])  # fmt: skip
        found.append(RigidTransform(RotationMatrix(rotation_from_vector(step[:3])), step[3:]))
    return found


def unknown_of(motion):
    """Exit points, in the plane where it lies along axes of W, and zeros of lengths."""
    inside = {(0.0, 1.0, 0.0): "xz"}.get(motion.axis, "xyz") if motion.is_plane else "xyz"
    return (f"*.exit_point.[{inside}]", "length_offsets")


def program_of(motion, random, tracked=True):
    """A program of noisy lengths that count from anywhere, every other pose tracked; the truth."""
    true, at = true_model(motion), poses(motion, random)
    lengths = Point(true, Stations.at(at)).numbers[:, :, 0]
    true = replace(true, length_offset=random.uniform(-0.2, 0.2, 4))
    program = CalibrationProgram(
        _believed(true, motion, random), at, unknown_of(motion), motion=motion
    )
    noise = LENGTHS * random.standard_normal(lengths.shape)
    program.AddZeroedCables(lengths - true.length_offset + noise, LENGTHS, None)
    if not tracked:
        return program, true
    seen = np.arange(COUNT) % 2 == 0
    if motion.is_point:
        points = np.array([X.translation() for X in at])
        points = points + PLACE * random.standard_normal(points.shape)
        program.AddTrackedPoints(np.where(seen[:, None], points, np.nan), PLACE)
    else:
        told = [
            RigidTransform(
                rotation_from_vector(TURN * random.standard_normal(3)) @ X.rotation(),
                X.translation() + PLACE * random.standard_normal(3),
            )
            for X in at
        ]
        program.AddTrackedPoses(
            [X if s else None for X, s in zip(told, seen, strict=True)], TURN, PLACE
        )
    if motion.is_plane or motion.name == "1T":
        program.AddPrior(["exit_points"], BELIEVED)
    return program, true


def _believed(true, motion, random):
    off = BELIEVED * random.standard_normal((3, 4))
    if motion.axis == (0.0, 1.0, 0.0):
        off[1] = 0.0
    return replace(true, cables=replace(true.cables, p_WA=true.cables.p_WA + off))


def chi_square(motion, count):
    """Squared errors over their covariance, per parameter that is told, averaged over logs."""
    total, told = 0.0, 0
    for number in range(count):
        program, true = program_of(motion, np.random.default_rng([number, 11]))
        result = program.Solve(outliers=False)
        assert result.status == "converged"
        free = program.free
        errors = model_difference(result.model, true)[free] / result.typical
        scaled = result.covariance / np.outer(result.typical, result.typical)
        values, V = np.linalg.eigh(scaled)
        keep = values > 1e-10 * values[-1]
        parts = V[:, keep].T @ errors
        total, told = total + float(np.sum(parts**2 / values[keep])), told + int(np.sum(keep))
    return total / told


def main():
    """Prints chi-square by motion type."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    count = parser.parse_args().count
    for name, motion in MOTIONS.items():
        print(f"{name}: {chi_square(motion, count):.3f} over {count} logs", flush=True)


if __name__ == "__main__":
    main()
