"""Study: how well robots are calibrated from a tracker, from the camera on board, from winches.

It repeats simulated calibrations over seeds: errors beside the Cramer-Rao bound, beside the
covariance that each reports, and what a visual servo gains from a calibrated robot.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from pydrake.math import RigidTransform
from scipy.stats import chi2

from cdpr_drake.analyses.fits.calibration import fit_robot
from cdpr_drake.analyses.fits.robots import calibrated_robot, calibration_model, rest_poses
from cdpr_drake.analyses.fits.setup import CalibrationTask, Sigmas
from cdpr_drake.analyses.frame.figures import line_style, new_figure
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.studies.facts import MissingRuns
from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study, select
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
from cdpr_drake.geometry.pose_accuracy import distances_from_line
from cdpr_drake.geometry.poses import (
    angles_from_rotation,
    pose_error,
    pose_from_angles,
    rotation_from_vector,
)
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_loader import load_robot, robot_reference
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.palette import BOUND, nth_look
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget

ROBOT, MOUNT = "acrobot_small", "onboard"

POSES, CANDIDATES, START_POSES = 40, 150, 60
"""Poses of calibrations by camera and tracker, of how many they are chosen, and by winches."""

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
TARGETS: dict[int, PointTarget] = {k: TagTarget(k, TAG_SIZE) for k in range(len(TAG_PLACES))}

START_OFF, START_TURNED = 0.3, np.radians(20.0)
"""How far off the start of a calibration by winches is believed to be [m, rad]."""

LENGTH_SHARE, TENSION_SIGMA = 1e-3, 0.1
"""Of that calibration: noise of lengths over the length, and of tensions [N]."""

SCENARIO = "acrobot_pbvs_line"
CHANGES = ("camera.kind=projected", "camera.pixel_noise=0.0", "integration.engine=compiled")
"""A servo without noise of the image, so that only the model bends the path."""

SURE = 0.01
"""Share of studies with right covariances in which chi-square of all seeds is called wrong."""

LIMITS = {"exit": 1e-3, "anchor": 0.5e-3}
"""Errors of points within which a calibration by camera should be, drawn in its figure [m]."""


# What is calibrated.


@dataclass(frozen=True, eq=False)
class CameraTrial:
    """A robot that is believed wrongly and calibrated by its camera.

    Attributes:
        result: The calibration.
        true: The true robot.
        believed: As it was believed before.
        errors: Of the unknown parameters, shape (f,).
    """

    result: CalibrationResult
    true: CalibrationModel
    believed: CalibrationModel
    errors: Array

    def normalized_squares(self) -> tuple[float, float]:
        """Errors over their covariance, squared and summed: chi-square of f if it is right.

        Of errors with frames moved along their arcs, and of the straight differences.
        """
        along, straight = (
            float(errors @ np.linalg.solve(self.result.covariance, errors))
            for errors in (self.result.errors_from(self.true), self.errors)
        )
        return along, straight


def true_model() -> CalibrationModel:
    """The true robot over tags on the floor."""
    tags = {
        k: pose_from_angles(np.array([x, y, 0.0]), np.array([0.0, 0.0, 0.3 * k]))
        for k, (x, y) in enumerate(TAG_PLACES)
    }
    return with_tags(calibration_model(load_robot(ROBOT), MOUNT), tags)


def _wrong_points(
    true: CalibrationModel, random: np.random.Generator, size: float = 1.0
) -> CalibrationModel:
    """The robot with exit and anchor points off."""
    points = {}
    for name, distance in (("p_WA", EXITS_OFF), ("p_PB", ANCHORS_OFF)):
        right = getattr(true.cables, name)
        steps = random.standard_normal(right.shape)
        points[name] = right + size * distance * steps / np.linalg.norm(steps, axis=0)
    return replace(true, cables=replace(true.cables, **points))


@lru_cache
def designed_poses() -> tuple[RigidTransform, ...]:
    """The poses of all calibrations by camera: those of which the camera is expected to tell most.

    Chosen D-optimally among `CANDIDATES` poses at which the robot can rest.
    """
    random, true, robot = np.random.default_rng(0), true_model(), load_robot(ROBOT)
    candidates, _ = rest_poses(robot, CANDIDATES, random)
    uv = simulated_corners(true, candidates, TARGETS, _pinhole(), 0.0, random)
    program = CalibrationProgram(true, candidates, UNKNOWN)
    start = _lengths(true, candidates[0])
    readings = simulated_lengths(true, candidates, start, 0.0, random)
    _measure(program, readings, start, uv)
    problem = program.least_squares()
    S = problem.normal_equations(program.at(), 0.0)
    known = S.S - S.S_data + 1e-4 * np.eye(len(S.S))
    chosen, _ = choose_poses(informing_rows(problem, program.at()), POSES, known)
    return tuple(candidates[k] for k in np.sort(chosen))


def _pinhole() -> Pinhole:
    return load_camera("ids_kowa").pinhole(*IMAGE)


def _measure(
    program: CalibrationProgram, readings: Array, start: Array, uv: Array, size: float = 1.0
) -> None:
    """Adds what the camera's trials measure, and what is known beforehand."""
    program.AddLengths(readings, size * LENGTH_SIGMA, start)
    points = {k: target.points for k, target in TARGETS.items()}
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
    believed = _wrong_points(true, random, size)
    X_PC = RigidTransform(
        rotation_from_vector(size * CAMERA_TURNED * random.standard_normal(3))
        @ true.X_PC.rotation(),
        true.X_PC.translation() + size * CAMERA_OFF * random.standard_normal(3),
    )
    believed = replace(believed, X_PC=X_PC, tags={})
    start = _lengths(true, poses[0])
    pinhole = _pinhole()
    readings = simulated_lengths(true, poses, start, size * LENGTH_SIGMA, random)
    uv = simulated_corners(true, poses, TARGETS, pinhole, size * CORNER_SIGMA, random)
    trial = CalibrationProgram(believed, [robot.home.transform()] * POSES, ())
    trial.AddLengths(readings, size * LENGTH_SIGMA, start)
    at = guessed_stations(believed, trial.terms, POSES, robot.home.transform()).poses()
    model = with_tags(believed, guessed_tags(believed, at, TARGETS, uv, pinhole))
    at = poses_by_tags(model, at, TARGETS, uv, pinhole)
    program = CalibrationProgram(model, at, UNKNOWN)
    _measure(program, readings, start, uv, size)
    result = program.Solve(outliers=False)
    return CameraTrial(result, true, believed, model_difference(result.model, true)[program.free])


def camera_row(seed: int) -> dict[str, Any]:
    """A calibration by the camera on board.

    Returns:
        exit_points_m, anchor_points_m: root mean square distances from the true ones, without what
        moves a whole frame, which the camera hardly sees or does not see at all; errors_chi_square,
        errors_chi_square_straight: errors over their covariance with frames moved along arcs, and
        straight, and its degrees of freedom; residuals_chi_square, and its.
    """
    trial = camera_trial(seed)
    along, straight = trial.normalized_squares()
    rest = trial.result.without_frames(trial.errors)
    points = {
        kind: rest[[f".{kind}." in name for name in trial.result.names]].reshape(-1, 3)
        for kind in ("exit_point", "anchor_point")
    }
    return {
        **{f"{kind}s_m": np.sqrt(np.mean(np.sum(p**2, axis=1))) for kind, p in points.items()},
        "errors_chi_square": along, "errors_chi_square_straight": straight,
        "errors_degrees": len(trial.errors),
        "residuals_chi_square": trial.result.chi_square,
        "residuals_degrees": trial.result.degrees,
    }  # fmt: skip


def half_row(seed: int) -> dict[str, Any]:
    """Chi-square of errors along arcs and straight, and with all that is off half as large."""
    row: dict[str, Any] = {}
    for name, size in (("whole", 1.0), ("half", 0.5)):
        along, straight = camera_trial(seed, size).normalized_squares()
        row |= {f"{name}_chi_square": along, f"{name}_chi_square_straight": straight}
    return row


def tracker_row(seed: int) -> dict[str, Any]:
    """Points calibrated by a tracker without any prior.

    Returns:
        errors_over_bound: errors of coordinates over their Cramer-Rao bounds, the least standard
        deviations that any unbiased estimate has, from the information at the truth, shape (48,)
        [-]; rms_over_bound: their root mean square.
    """
    random, true, robot = np.random.default_rng([seed, 2]), true_model(), load_robot(ROBOT)
    poses, _ = rest_poses(robot, POSES, random)
    start = _lengths(true, poses[0])
    readings = simulated_lengths(true, poses, start, LENGTH_SIGMA, random)
    tracked = simulated_poses(poses, TURN_SIGMA, PLACE_SIGMA, random)
    believed = _wrong_points(true, random)

    def program(model: CalibrationModel, at: list[RigidTransform]) -> CalibrationProgram:
        made = CalibrationProgram(model, at, ["exit_points", "anchor_points"])
        made.AddLengths(readings, LENGTH_SIGMA, start)
        made.AddTrackedPoses(tracked, TURN_SIGMA, PLACE_SIGMA)
        return made

    unknown = program(believed, tracked)
    result = unknown.Solve(outliers=False)
    truth = program(true, poses)
    information = truth.least_squares().normal_equations(truth.at(), 0.0).S
    typical = truth.layout.typical[truth.free]
    bound = np.sqrt(np.diag(np.linalg.inv(information))) * typical
    ratios = model_difference(result.model, true)[unknown.free] / bound
    return {"errors_over_bound": ratios, "rms_over_bound": np.sqrt(np.mean(np.square(ratios)))}


def start_row(seed: int) -> dict[str, Any]:
    """Distance and angle of the start that winches and tensions alone find.

    Returns:
        distance_m, angle_deg; distance_std_m, angle_std_deg: standard deviations of both, as the
        calibration reports them.
    """
    random, true, robot = np.random.default_rng([seed, 3]), true_model(), load_robot(ROBOT)
    poses, tensions = rest_poses(robot, START_POSES, random)
    lengths = Point(true, Stations.at(poses)).numbers[:, :, 0]
    noisy = lengths * (1.0 + LENGTH_SHARE * random.standard_normal(lengths.shape))
    counted = (noisy - lengths[0]) / (1.0 + tensions / robot.stiffness())
    log = Measurements(
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
    task = CalibrationTask(
        robot=robot, log=log, unknown=("length_offsets",), sigmas=sigmas, start=wrong,
        outliers=False,
    )  # fmt: skip
    result = fit_robot(task).result
    turn, place = result.pose_std[0]
    distance, angle = pose_error(poses[0], result.stations.poses()[0])
    return {
        "distance_m": distance, "angle_deg": np.degrees(angle),
        "distance_std_m": float(place), "angle_std_deg": np.degrees(float(turn)),
    }  # fmt: skip


def servo_row(seed: int) -> dict[str, Any]:
    """straightness_m: largest distance of the camera's path from the straight line, by belief."""
    return {"straightness_m": straightness(camera_trial(seed))}


def straightness(trial: CameraTrial) -> dict[str, float]:
    """Largest distance of the camera's path from the straight line, by what is believed [m].

    The platform's first pose is believed to be where each robot's own lengths put it, as a winch
    controller would have it: in the frames of that robot.
    """
    models = {
        "true": None, "believed before": trial.believed, "calibrated": trial.result.model,
    }  # fmt: skip
    distances = {}
    for name, model in models.items():
        scenario = load_scenario(SCENARIO, CHANGES)
        if model is None:
            run = ServoRun(scenario).simulate()
        else:
            X_WP = scenario.initial_pose.transform()
            program = CalibrationProgram(model, [X_WP], ())
            own = calibration_model(load_robot(ROBOT))
            program.AddLengths(_lengths(own, X_WP)[None], LENGTH_SIGMA)
            (X,) = guessed_stations(model, program.terms, 1, X_WP).poses()
            result = replace(trial.result, model=model)
            believed = calibrated_robot(load_robot(ROBOT), result, MOUNT)[0]
            with robot_reference(believed) as file:
                scenario.perturbations.believed_robot = file
                scenario.perturbations.initial_pose = Pose(
                    position=np.array(X.translation()),
                    angles_deg=np.degrees(angles_from_rotation(X.rotation())),
                )
                run = ServoRun(scenario).simulate()
        path_W, line = run.camera_path, run.camera_line
        distances[name] = float(np.max(distances_from_line(path_W, *line)))
    return distances


def _lengths(model: CalibrationModel, X_WP: RigidTransform) -> Array:
    return np.asarray(Point(model, Stations.at([X_WP])).numbers[0, :, 0])


def cases(form: Form) -> Iterator[Case]:
    """Kinds of calibrations; one with the half, and one servo, in the quick form."""
    calls = {
        "camera": (camera_row, None), "half": (half_row, 20), "servo": (servo_row, 5),
        "tracker": (tracker_row, None), "start": (start_row, None),
    }  # fmt: skip
    for kind, (call, most) in calls.items():
        limit = 1 if form.quick and most else most
        yield Case(keys={"kind": kind}, call=partial(call), seeds=form.times(100, 2, limit))


# What facts ask of several seeds.


def by_degrees(squares: Any, degrees: int) -> tuple[bool, str]:
    """Whether right covariances give such a chi-square of all seeds, and words on it, per degree of
    freedom."""
    ratio = np.sum(squares) / degrees
    low, high = chi2.ppf([SURE / 2, 1 - SURE / 2], degrees) / degrees
    return bool(low < ratio < high), f"{ratio:.3f} (accepted {low:.3f} to {high:.3f})"


def covariance(rows: Frame) -> tuple[list[bool], str]:
    """Errors and residuals beside covariances."""
    camera = select(rows, kind="camera")
    degrees = camera["errors_degrees"].sum()
    errors, of_errors = by_degrees(camera["errors_chi_square"], degrees)
    residuals, of_residuals = by_degrees(
        camera["residuals_chi_square"], camera["residuals_degrees"].sum()
    )
    straight = camera["errors_chi_square_straight"].sum() / degrees
    return [errors and residuals], (
        f"errors {of_errors}, residuals {of_residuals}; "
        f"{straight:.3f} of errors along straight coordinates"
    )


def curvature(rows: Frame) -> tuple[list[bool], str]:
    """Whether what errors along straight coordinates have too much is of second order."""
    seeds = select(rows, kind="half")
    if len(seeds) < 2:
        raise MissingRuns("more than one seed: of one alone the excess may have either sign")
    whole, half = (
        (seeds[f"{size}_chi_square_straight"] - seeds[f"{size}_chi_square"]).mean()
        for size in ("whole", "half")
    )
    words = f"{whole:.2f} to {half:.2f} of chi-square, mean over {len(seeds)} seeds"
    return [bool(whole > 0.0 and abs(half) < 0.5 * whole)], f"{words}, of equal random numbers"


def reported(rows: Frame) -> tuple[list[bool], str]:
    """Errors of the start over their standard deviations, of all seeds."""
    start = select(rows, kind="start")
    shares = np.array([
        start["distance_m"] / start["distance_std_m"], start["angle_deg"] / start["angle_std_deg"]
    ])  # fmt: skip
    # Of all ways to share a variance among three coordinates, one alone spreads the most.
    sure = chi2.isf(SURE / len(start), 1) ** 0.5
    place, turn = np.sqrt(np.mean(shares**2, axis=1))
    return [bool(np.all(shares < sure))], (
        f"{shares[0].max():.2f} and {shares[1].max():.2f} at most (accepted {sure:.2f}), "
        f"{place:.2f} and {turn:.2f} rms; deviations up to "
        f"{1e3 * start['distance_std_m'].max():.1f} mm and {start['angle_std_deg'].max():.2f} deg"
    )


# What is shown.


def table(rows: Frame) -> Frame:
    """Errors over seeds."""
    lines = []
    for name, kind, column, scale, unit in (
        ("camera, exit points", "camera", "exit_points_m", 1e3, "mm"),
        ("camera, anchor points", "camera", "anchor_points_m", 1e3, "mm"),
        ("winches, start", "start", "distance_m", 1e3, "mm"),
        ("winches, start", "start", "angle_deg", 1.0, "deg"),
    ):
        values = scale * select(rows, kind=kind)[column]
        numbers = {"median": values.median(), "largest": values.max(), "unit": unit}
        lines.append({"by": name, "seeds": len(values), **numbers})
    return Frame(lines)


def figure(rows: Frame) -> Figure:
    """Errors of points, chi-square beside its distribution, errors over their bounds."""
    drawn, axes = new_figure(1, 3, (16.0, 5.0), "Calibration over seeds")
    kinds = dict([*rows.groupby("kind", sort=False)])
    if "camera" in kinds:
        for k, (name, limit) in enumerate(LIMITS.items()):
            look, label = nth_look(k), f"{name} points"
            values = np.sort(1e3 * kinds["camera"][f"{name}_points_m"])
            axes[0].plot(values, label=label, marker="osv"[k], **line_style(look))
            axes[0].axhline(1e3 * limit, color=look.color, linestyle=(":", "-.")[k],
                            label=f"{label}: {1e3 * limit:g} mm")  # fmt: skip
        squares, degrees = kinds["camera"]["errors_chi_square"], kinds["camera"]["errors_degrees"]
        draw_chi_square(axes[1], squares, int(degrees.iloc[0]))
    axes[0].set(xlabel="seeds, sorted", ylabel="error, rms [mm]", title="by the camera alone")
    axes[1].set(xlabel="errors over covariance, squared [-]", ylabel="share of seeds",
                title="covariance")  # fmt: skip
    if "tracker" in kinds:
        ratios = np.array([arrays["errors_over_bound"] for arrays in kinds["tracker"]["arrays"]])
        each = np.sqrt(np.mean(np.square(ratios), axis=0))
        axes[2].plot(np.sort(each), marker="o", label="coordinates", **line_style(nth_look(2)))
        axes[2].axhline(1.0, label="Cramer-Rao bound", **line_style(BOUND))
    axes[2].set(xlabel="coordinates, sorted", ylabel="rms error over its bound [-]",
                title="by a tracker: Cramer-Rao")  # fmt: skip
    for panel in axes:
        if panel.get_legend_handles_labels()[0]:
            panel.legend()
    return drawn


def draw_chi_square(axes: Axes, squares: Any, degrees: int) -> None:
    """Squares of errors over covariances of some seeds, beside their distribution."""
    values = np.sort(squares)
    share = (np.arange(len(values)) + 0.5) / len(values)
    axes.plot(values, share, marker="o", label="found", **line_style(nth_look(0)))
    low, high = chi2.ppf([0.001, 0.999], degrees)
    x = np.linspace(float(low), float(high), 200)
    axes.plot(x, chi2.cdf(x, degrees), label="chi-square", **line_style(BOUND))


STUDY = Study(
    name="calibration",
    title="Calibration by camera, tracker and winches beside the Cramer-Rao bound",
    cases=cases,
    parameters=lambda form: {
        "robot": ROBOT, "mount": MOUNT, "poses": POSES, "candidates": CANDIDATES,
        "start_poses": START_POSES, "unknown": UNKNOWN, "exits_off_m": EXITS_OFF,
        "anchors_off_m": ANCHORS_OFF, "camera_off_m": CAMERA_OFF,
        "camera_turned_rad": CAMERA_TURNED, "length_sigma_m": LENGTH_SIGMA,
        "corner_sigma_px": CORNER_SIGMA, "place_sigma_m": PLACE_SIGMA,
        "turn_sigma_rad": TURN_SIGMA, "tag_size_m": TAG_SIZE, "image_px": IMAGE,
        "tag_places_m": TAG_PLACES, "start_off_m": START_OFF, "start_turned_rad": START_TURNED,
        "length_share": LENGTH_SHARE, "tension_sigma_n": TENSION_SIGMA, "scenario": SCENARIO,
        "changes": CHANGES,
    },
    finds={"covariance": covariance, "curvature": curvature, "reported": reported},
    tables={"Calibrations": table},
    figures={"calibration": figure},
)  # fmt: skip
