"""One simulated calibration of each kind, by a seed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform

from cdpr_drake.analyses.calibration.calibrated_robots import calibration_model
from cdpr_drake.analyses.calibration.calibration_request import CalibrationTask, Sigmas
from cdpr_drake.analyses.calibration.calibration_task import calibrate
from cdpr_drake.analyses.calibration.candidate_poses import rest_poses
from cdpr_drake.analyses.calibration.log_file import CalibrationLog
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.guesses import guessed_tags, poses_by_tags, with_tags
from cdpr_drake.calibration.measurements import (
    simulated_corners,
    simulated_lengths,
    simulated_poses,
)
from cdpr_drake.calibration.parameters import CalibrationModel, model_difference
from cdpr_drake.calibration.pose_design import choose_poses, informing_rows
from cdpr_drake.calibration.pose_search import guessed_stations
from cdpr_drake.calibration.program import CalibrationProgram
from cdpr_drake.calibration.result import CalibrationResult
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.geometry.poses import pose_error, pose_from_angles, rotation_from_vector
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget

ROBOT, MOUNT = "acrobot_small", "onboard"
POSES, CANDIDATES, START_POSES = 40, 150, 60
UNKNOWN = ("exit_points", "anchor_points", "camera", "tags")
EXITS_OFF, ANCHORS_OFF = 0.010, 0.005
"""How far points are from where they are believed, in directions drawn at random [m]."""
CAMERA_OFF, CAMERA_TURNED = 0.003, np.radians(0.5)
"""Deviations of each coordinate of the camera's pose [m, rad]."""
LENGTH_SIGMA, CORNER_SIGMA = 1e-4, 0.2
"""Noise of lengths [m] and of corners [px]."""
PLACE_SIGMA, TURN_SIGMA = 2e-4, 5e-4
"""Noise of the tracker [m, rad]."""
TAG_SIZE, IMAGE = 0.06, (640, 480)
TAG_PLACES = tuple((x, y) for x in (-0.2, 0.0, 0.2) for y in (-0.15, 0.15))
START_OFF, START_TURNED = 0.3, np.radians(20.0)
HALF = 0.5
"""Size of noise and of all that is off in the trials that show what is not linear."""
LENGTH_SHARE, TENSION_SIGMA = 1e-3, 0.1
"""Of the self-calibration: noise of lengths over the length, and of tensions [N]."""


@dataclass(frozen=True, eq=False)
class CameraTrial:
    """A robot that is believed wrongly and calibrated by its camera.

    Attributes:
        result: What was found.
        true: The true robot.
        believed: As it was believed before.
        free: Which parameters were unknown.
    """

    result: CalibrationResult
    true: CalibrationModel
    believed: CalibrationModel
    free: npt.NDArray[np.bool_]

    def errors(self) -> Array:
        """Of the unknown parameters, shape (f,)."""
        return model_difference(self.result.model, self.true)[self.free]

    def point_errors(self) -> tuple[float, float]:
        """Root mean square distances of exit and anchor points from the true ones [m].

        Without what moves a whole frame, which the camera hardly sees or does not see at all.
        """
        left = self.result.without_frames(self.errors())
        return (
            _rms(left[[".exit_point." in name for name in self.result.names]]),
            _rms(left[[".anchor_point." in name for name in self.result.names]]),
        )

    def normalized_squares(self) -> tuple[float, float]:
        """Errors over their covariance, squared and summed: chi-square of f if it is right.

        Of errors with frames moved along their arcs, and of the straight differences.
        """
        errors = self.result.errors_from(self.true), self.errors()
        each = [e @ np.linalg.solve(self.result.covariance, e) for e in errors]
        return float(each[0]), float(each[1])


def _rms(values: Array) -> float:
    """Of distances, from coordinates one after the other [m]."""
    return float(np.sqrt(np.mean(np.sum(values.reshape(-1, 3) ** 2, axis=1))))


def true_model() -> CalibrationModel:
    """The true robot over tags on the floor."""
    tags = {
        k: pose_from_angles(np.array([x, y, 0.0]), np.array([0.0, 0.0, 0.3 * k]))
        for k, (x, y) in enumerate(TAG_PLACES)
    }
    return with_tags(calibration_model(load_robot(ROBOT), MOUNT), tags)


def _off(points: Array, distance: float, random: np.random.Generator) -> Array:
    steps = random.standard_normal(points.shape)
    return np.asarray(points + distance * steps / np.linalg.norm(steps, axis=0))


@lru_cache
def designed_poses() -> tuple[RigidTransform, ...]:
    """The poses of all calibrations by camera: those of which the camera is expected to tell most.

    Chosen D-optimally among `CANDIDATES` poses at which the robot can rest.
    """
    random, true, robot = np.random.default_rng(0), true_model(), load_robot(ROBOT)
    candidates, _ = rest_poses(robot, CANDIDATES, random)
    uv = simulated_corners(true, candidates, _targets(true), _pinhole(), 0.0, random)
    program = CalibrationProgram(true, candidates, UNKNOWN)
    start = _lengths(true, candidates[0])
    readings = simulated_lengths(true, candidates, start, 0.0, random)
    _measure(program, readings, start, uv)
    problem = program.least_squares()
    S = problem.normal_equations(program.at(), 0.0)
    known = S.S - S.S_data + 1e-4 * np.eye(len(S.S))
    chosen, _ = choose_poses(informing_rows(problem, program.at()), POSES, known)
    return tuple(candidates[k] for k in np.sort(chosen))


def _targets(model: CalibrationModel) -> dict[int, PointTarget]:
    return {k: TagTarget(k, TAG_SIZE) for k in model.tags}


def _pinhole() -> Pinhole:
    return load_camera("ids_kowa").pinhole(*IMAGE)


def _measure(
    program: CalibrationProgram, readings: Array, start: Array, uv: Array, size: float = 1.0
) -> None:
    """Adds what the camera's trials measure, and what is known beforehand."""
    program.AddLengths(readings, size * LENGTH_SIGMA, start)
    points = {k: target.points for k, target in _targets(program.model).items()}
    program.AddTagCorners(points, uv, size * CORNER_SIGMA, _pinhole())
    # Directions are drawn at random, so that a coordinate has a third of the square.
    program.AddPrior(["exit_points"], size * EXITS_OFF / np.sqrt(3.0))
    program.AddPrior(["anchor_points"], size * ANCHORS_OFF / np.sqrt(3.0))
    program.AddPrior(["camera.r?"], size * CAMERA_TURNED)
    program.AddPrior(["camera.[xyz]"], size * CAMERA_OFF)


def camera_trial(seed: int, size: float = 1.0) -> CameraTrial:
    """Calibration by the camera on board over tags of unknown place; its mounting is off, too.

    Args:
        seed: Of the random numbers.
        size: Of all noise and of all that is off, over what the study has, with the same random
            numbers: what is linear comes out the same over its deviations.
    """
    random, true, robot = np.random.default_rng([seed, 1]), true_model(), load_robot(ROBOT)
    poses = designed_poses()
    cables = replace(
        true.cables,
        p_WA=_off(true.cables.p_WA, size * EXITS_OFF, random),
        p_PB=_off(true.cables.p_PB, size * ANCHORS_OFF, random),
    )
    X_PC = RigidTransform(
        rotation_from_vector(size * CAMERA_TURNED * random.standard_normal(3))
        @ true.X_PC.rotation(),
        true.X_PC.translation() + size * CAMERA_OFF * random.standard_normal(3),
    )
    believed = replace(true, cables=cables, X_PC=X_PC, tags={})
    start = _lengths(true, poses[0])
    targets, pinhole = _targets(true), _pinhole()
    readings = simulated_lengths(true, poses, start, size * LENGTH_SIGMA, random)
    uv = simulated_corners(true, poses, targets, pinhole, size * CORNER_SIGMA, random)
    trial = CalibrationProgram(believed, [robot.home.transform()] * POSES, ())
    trial.AddLengths(readings, size * LENGTH_SIGMA, start)
    at = guessed_stations(believed, trial.terms, POSES, robot.home.transform()).poses()
    model = with_tags(believed, guessed_tags(believed, at, targets, uv, pinhole))
    at = poses_by_tags(model, at, targets, uv, pinhole)
    program = CalibrationProgram(model, at, UNKNOWN)
    _measure(program, readings, start, uv, size)
    return CameraTrial(program.Solve(outliers=False), true, believed, program.free)


def tracker_trial(seed: int) -> tuple[Array, Array]:
    """Errors of points calibrated by a tracker without any prior, and their Cramer-Rao bounds.

    Returns:
        Errors of the coordinates, and the least standard deviations that any unbiased estimate
        has, from the information at the truth; each shape (48,) [m].
    """
    random, true, robot = np.random.default_rng([seed, 2]), true_model(), load_robot(ROBOT)
    poses, _ = rest_poses(robot, POSES, random)
    start = _lengths(true, poses[0])
    readings = simulated_lengths(true, poses, start, LENGTH_SIGMA, random)
    tracked = simulated_poses(poses, TURN_SIGMA, PLACE_SIGMA, random)
    cables = replace(
        true.cables,
        p_WA=_off(true.cables.p_WA, EXITS_OFF, random),
        p_PB=_off(true.cables.p_PB, ANCHORS_OFF, random),
    )

    def program(model: CalibrationModel, at: list[RigidTransform]) -> CalibrationProgram:
        made = CalibrationProgram(model, at, ["exit_points", "anchor_points"])
        made.AddLengths(readings, LENGTH_SIGMA, start)
        made.AddTrackedPoses(tracked, TURN_SIGMA, PLACE_SIGMA)
        return made

    asked = program(replace(true, cables=cables), tracked)
    found = asked.Solve(outliers=False)
    truth = program(true, poses)
    information = truth.least_squares().normal_equations(truth.at(), 0.0).S
    typical = truth.layout.typical[truth.free]
    bound = np.sqrt(np.diag(np.linalg.inv(information))) * typical
    return model_difference(found.model, true)[asked.free], bound


def start_trial(seed: int) -> tuple[float, float, float, float]:
    """Distance [m] and angle [rad] of the start that winches and tensions alone find.

    Behind them the standard deviations of both, as the calibration tells them.
    """
    random, true, robot = np.random.default_rng([seed, 3]), true_model(), load_robot(ROBOT)
    poses, tensions = rest_poses(robot, START_POSES, random)
    lengths = Point(true, Stations.at(poses)).numbers[:, :, 0]
    noisy = lengths * (1.0 + LENGTH_SHARE * random.standard_normal(lengths.shape))
    counted = (noisy - lengths[0]) / (1.0 + tensions / robot.stiffness())
    log = CalibrationLog(
        Path("simulated"), START_POSES, lengths=counted,
        tensions=tensions + TENSION_SIGMA * random.standard_normal(tensions.shape),
    )  # fmt: skip
    direction, axis = random.standard_normal((2, 3))
    wrong = RigidTransform(
        rotation_from_vector(START_TURNED * axis / np.linalg.norm(axis)) @ poses[0].rotation(),
        poses[0].translation() + START_OFF * direction / np.linalg.norm(direction),
    )
    sigmas = Sigmas(
        lengths=1e-6, lengths_share=LENGTH_SHARE, tensions=TENSION_SIGMA, moments=5e-3, forces=5e-2
    )
    task = CalibrationTask(robot, ("length_offsets",), sigmas=sigmas, start=wrong, outliers=False)
    found = calibrate(task, log).result
    turn, place = found.pose_std[0]
    return *pose_error(poses[0], found.stations.poses()[0]), float(place), float(turn)


def _lengths(model: CalibrationModel, X_WP: RigidTransform) -> Array:
    return np.asarray(Point(model, Stations.at([X_WP])).numbers[0, :, 0])


def robot_lengths(robot: Robot, X_WP: RigidTransform) -> Array:
    """Lengths of a robot's cables at a pose, shape (m,) [m]."""
    return _lengths(calibration_model(robot), X_WP)
