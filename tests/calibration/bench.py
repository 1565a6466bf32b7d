"""A robot with a camera over a few tags, and what it measures: shared by tests of calibration."""

from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.calibration.measurements import simulated_corners, simulated_lengths
from cdpr_drake.calibration.parameters import CalibrationModel
from cdpr_drake.calibration.program import CalibrationProgram
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_from_angles, rotation_from_vector
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.pinhole import Pinhole

PINHOLE = Pinhole.from_view_angles(640, 480, np.radians(79.0), np.radians(59.4))
TAG_PLACES = [(x, y) for x in (-0.2, 0.0, 0.2) for y in (-0.15, 0.15)]
TARGETS = {k: TagTarget(k, 0.06) for k in range(len(TAG_PLACES))}


def true_model() -> CalibrationModel:
    """Eight cables over pulleys in a cube of 1 m, a camera that looks down, tags on the floor."""
    corner = np.array([[-1, -1, -1, -1, 1, 1, 1, 1], [-1, -1, 1, 1, 1, 1, -1, -1]], float)
    p_WA = np.vstack([0.5 * corner, np.full(8, 1.1)])
    p_WA[:2] += 0.03 * np.array([[1, -1, -1, 1, -1, 1, 1, -1], [-1, 1, 1, -1, -1, 1, 1, -1]])
    signs = [1, -1, -1, 1, -1, 1, 1, -1], [-1, 1, -1, 1, 1, -1, 1, -1], [1, 0, 1, 0, 1, 0, 1, 0]
    p_PB = 0.06 * np.array(signs, float)
    return CalibrationModel(
        tuple(f"C{i + 1}" for i in range(8)),
        CableSet.make(p_WA, p_PB, 1e5, pulley_radius=0.02),
        pose_from_angles(np.array([-0.06, 0.0, 0.01]), np.array([0.0, np.pi, 0.0])),
        {
            k: pose_from_angles(np.array([x, y, 0.0]), np.array([0.0, 0.0, 0.3 * k]))
            for k, (x, y) in enumerate(TAG_PLACES)
        },
    )


def poses(count: int, random: np.random.Generator) -> list[RigidTransform]:
    """Poses above the tags."""
    return [
        pose_from_angles(
            np.append(random.uniform(-0.25, 0.25, 2), random.uniform(0.15, 0.6)),
            random.uniform(-0.35, 0.35, 3),
        )
        for _ in range(count)
    ]


def start_readings(model: CalibrationModel, X_WP: RigidTransform) -> np.ndarray:
    """True lengths at a pose, from which winches count."""
    return Point(model, Stations.at([X_WP])).numbers[0, :, 0]


def wrong_model(
    true: CalibrationModel, exits: float, anchors: float, random: np.random.Generator
) -> CalibrationModel:
    """A robot whose points are off, normally with these deviations of each coordinate [m]."""
    cables = replace(
        true.cables,
        p_WA=true.cables.p_WA + exits * random.standard_normal((3, 8)),
        p_PB=true.cables.p_PB + anchors * random.standard_normal((3, 8)),
    )
    return replace(true, cables=cables)


def nearby(X: RigidTransform, turn: float, place: float, random: np.random.Generator):
    """A pose that is off by random turns [rad] and places [m]."""
    return RigidTransform(
        rotation_from_vector(turn * random.standard_normal(3)) @ X.rotation(),
        X.translation() + place * random.standard_normal(3),
    )


def camera_program(
    true: CalibrationModel, start: CalibrationModel, unknown: list[str], *, count: int, random
) -> CalibrationProgram:
    """Lengths with 0.1 mm and corners with 0.2 px of noise at poses; guesses a little off."""
    at = poses(count, random)
    zero = start_readings(true, at[0])
    program = CalibrationProgram(start, [nearby(X, 0.01, 0.005, random) for X in at], unknown)
    program.AddLengths(simulated_lengths(true, at, zero, 1e-4, random), 1e-4, zero)
    uv = simulated_corners(true, at, TARGETS, PINHOLE, 0.2, random)
    program.AddTagCorners({k: t.points for k, t in TARGETS.items()}, uv, 0.2, PINHOLE)
    return program
