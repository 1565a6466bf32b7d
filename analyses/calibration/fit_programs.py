"""From a log that was checked to programs, one for each place where the platform may have begun."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.calibration.calibration_request import Prepared
from cdpr_drake.analyses.calibration.motion_start import off_plane
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.guesses import guessed_tags, poses_by_tags, with_tags
from cdpr_drake.calibration.parameters import CalibrationModel
from cdpr_drake.calibration.pose_search import guessed_from
from cdpr_drake.calibration.program import CalibrationProgram, first_readings
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.methods import distribute


@dataclass(frozen=True, eq=False)
class StartPoint:
    """Where a search begins.

    Attributes:
        model: The model with guesses of what readings count from.
        poses: Guesses of the poses X_WP [m].
    """

    model: CalibrationModel
    poses: list[RigidTransform]


def start_points(prepared: Prepared, firsts: Sequence[RigidTransform]) -> list[StartPoint]:
    """Guesses of what readings count from, and of the poses that follow, for each first pose.

    Where all poses are tracked, those; else one after the other from the first.

    Raises:
        CalibrationError: A start is impossible.
    """
    log, tracked = prepared.log, prepared.tracked
    seen = next((X for X in tracked or () if X is not None), None)
    seeds = list(firsts) if seen is None else [seen] * len(firsts)
    counting = [_counting(prepared, seed) for seed in seeds]
    models = [model for model, _ in counting]
    if tracked is not None and all(X is not None for X in tracked):
        known = [X for X in tracked if X is not None]
        return [StartPoint(model, known) for model in models]
    count, freedom, m = log.count, prepared.freedom, prepared.model.cables.count
    # Balance is hard to follow from afar; it is asked where lengths and the like are too few.
    told = m * ((prepared.lengths is not None) + (log.swivels is not None))
    rest = prepared.rest and told < freedom.motion.freedom
    tensions = None
    if rest:
        tensions = np.array([guessed_tensions(prepared, [seed] * count) for seed in seeds])
    first = None if tensions is None else tensions[0]
    trial = CalibrationProgram(models[0], [seeds[0]] * count, (), motion=freedom.motion)
    add_winches(prepared, trial, first)
    found = guessed_from(
        models, trial.terms, seeds, count=count, tensions=tensions, freedom=freedom,
        sure=not counting[0][1],
    )  # fmt: skip
    return [
        StartPoint(model, stations.poses()) for model, stations in zip(models, found, strict=True)
    ]


def _counting(prepared: Prepared, seed: RigidTransform) -> tuple[CalibrationModel, bool]:
    """The model with guesses of what readings count from, and whether lengths are unsure by it."""
    task, log, model = prepared.task, prepared.log, prepared.model
    asked = CalibrationProgram(model, [seed], (), motion=prepared.freedom.motion)
    free = asked.layout.select(prepared.unknown_of_robot())
    offsets = free[asked.layout.slices["length_offsets"]]
    unsure = bool(offsets.any()) and "length_offsets" not in task.priors
    unsure = unsure and task.zero is None
    at = Point(model, Stations.at([seed])).numbers[0]
    if prepared.lengths is not None and unsure:
        # Where winches began to count is not known: as if that had been at the first pose.
        guess = np.where(offsets, at[:, 0] - first_readings(prepared.lengths), 0.0)
        model = replace(model, length_offset=guess)
    if log.swivels is not None:
        model = replace(model, swivel_offset=at[:, 2] - first_readings(log.swivels))
    return model, unsure


def add_winches(prepared: Prepared, program: CalibrationProgram, tensions: Array | None) -> None:
    """Adds what robots measure of themselves.

    Args:
        prepared: The log.
        program: Gets it.
        tensions: Guesses, shape (k, m) [N]; None where balance is left out.
    """
    task, log, robot = prepared.task, prepared.log, prepared.task.robot
    sigmas = task.sigmas
    if prepared.lengths is not None and prepared.sigma is not None:
        strain = None
        if log.tensions is not None:
            strain = np.nan_to_num(log.tensions) / robot.stiffness()
        if prepared.is_zeroed():
            _add_zeroed(prepared, program, strain)
        else:
            start = first_readings(prepared.lengths)
            program.AddLengths(prepared.lengths, prepared.sigma, start, strain)
    if log.swivels is not None:
        program.AddSwivels(log.swivels, sigmas.swivels)
    if log.tilts is not None:
        program.AddTilts(log.tilts, sigmas.tilt, sigmas.yaw)
    if tensions is not None:
        weight = robot.platform.mass * robot.gravity_vector()
        com = robot.center_of_mass()
        program.AddRest(weight, com, sigmas.moments, sigmas.forces, tensions)
        if log.tensions is not None:
            share = sigmas.tensions_share * np.nan_to_num(np.abs(log.tensions))
            program.AddTensions(log.tensions, np.hypot(sigmas.tensions, share))


def _add_zeroed(prepared: Prepared, program: CalibrationProgram, strain: Array | None) -> None:
    """Adds cables that were counted from zero, by lengths or by motor angles."""
    robot, log, sigma = prepared.task.robot, prepared.log, prepared.sigma
    assert prepared.lengths is not None
    assert sigma is not None
    if log.lengths is not None or log.angles is None:
        program.AddZeroedCables(prepared.lengths, sigma, prepared.task.zero, strain=strain)
        return
    advantage = np.array([cable.mechanical_advantage for cable in robot.cables])
    program.AddZeroedCables(
        log.angles, sigma, prepared.task.zero, robot.drum(), strain=strain, advantage=advantage
    )


def guessed_tensions(prepared: Prepared, poses: Sequence[RigidTransform]) -> Array:
    """Tensions where they were measured, else those that hold the platform nearly, (k, m) [N]."""
    robot, log = prepared.task.robot, prepared.log
    count, m = len(poses), prepared.model.cables.count
    share = robot.platform.mass * robot.gravity / m
    guess = np.full((count, m), share)
    held: Array | None = None
    for k, X_WP in enumerate(poses):
        if k == 0 or X_WP is not poses[k - 1]:
            held = _held(prepared, X_WP)
        if held is not None:
            guess[k] = np.maximum(held, 0.01 * share)
    if log.tensions is not None:
        guess = np.where(np.isfinite(log.tensions), log.tensions, guess)
    return guess


def _held(prepared: Prepared, X_WP: RigidTransform) -> Array | None:
    """Tensions that hold the platform; None outside of the frame, or where it is singular."""
    try:
        robot = prepared.task.robot  # where a search begins: straight cables are near enough
        problem = tension_problem(robot, X_WP, cables=robot.cable_set(pulleys=False))
        found = distribute(problem, "quadratic_program").tensions
    except CdprError:
        return None
    return np.asarray(found, float) if np.isfinite(found).all() else None


def program_from(prepared: Prepared, begun: StartPoint) -> CalibrationProgram:
    """The program, with poses and tags guessed from where a search begins."""
    task, log, poses = prepared.task, prepared.log, prepared.tracked
    sigmas, motion = task.sigmas, prepared.freedom.motion
    model, at_rows = begun.model, begun.poses
    if poses is not None:
        at_rows = [g if X is None else X for g, X in zip(at_rows, poses, strict=True)]
    if prepared.targets:
        assert prepared.pinhole is not None
        missing = {t: T for t, T in prepared.targets.items() if t not in model.tags}
        if missing:
            uv = np.stack([log.corners[tag] for tag in missing], axis=1)
            model = with_tags(model, guessed_tags(model, at_rows, missing, uv, prepared.pinhole))
        if poses is None:
            targets = {tag: prepared.targets[tag] for tag in log.corners}
            uv = np.stack([log.corners[tag] for tag in targets], axis=1)
            at_rows = poses_by_tags(model, at_rows, targets, uv, prepared.pinhole)
    program = CalibrationProgram(model, at_rows, prepared.unknown, motion=motion)
    add_winches(prepared, program, guessed_tensions(prepared, at_rows) if prepared.rest else None)
    if log.poses is not None:
        program.AddTrackedPoses(log.poses, sigmas.turn, sigmas.place)
    if prepared.points is not None:
        times = log.time if program.free[program.layout.slices["clock"]].any() else None
        program.AddTrackedPoints(
            prepared.points, sigmas.place, normal=off_plane(task.robot),
            sigma_along=sigmas.off_plane, times=times,
        )  # fmt: skip
    if prepared.targets:
        assert prepared.pinhole is not None
        order = [tag for tag in model.tags if tag in prepared.targets]
        uv = np.stack([log.corners[tag] for tag in order], axis=1)
        points = {tag: prepared.targets[tag].points for tag in order}
        program.AddTagCorners(points, uv, sigmas.corners, prepared.pinhole)
    for name, std in prepared.priors.items():
        program.AddPrior([name], std)
    for name, most in task.bounds.items():
        program.AddBound([name], most)
    return program
