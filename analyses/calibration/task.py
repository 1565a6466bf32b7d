"""From a log and what is asked to a program, and to what it found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform
from scipy.stats import chi2

from cdpr_drake.analyses.calibration.asked import CalibrationTask, Prepared, prepare
from cdpr_drake.analyses.calibration.clock import check_clock
from cdpr_drake.analyses.calibration.log_file import CalibrationLog
from cdpr_drake.analyses.calibration.tracker import with_tracker
from cdpr_drake.arrays import Array
from cdpr_drake.calibration import (
    CalibrationModel,
    CalibrationProgram,
    CalibrationResult,
    Point,
    Stations,
    first_readings,
    guessed_stations,
    guessed_tags,
    poses_by_tags,
    with_tags,
)
from cdpr_drake.errors import CalibrationError, CdprError
from cdpr_drake.models import tension_problem
from cdpr_drake.spatial import pose_error, pose_from_angles
from cdpr_drake.tensions import distribute

MISFIT_STARTS = 2.0
"""A fit that is worse than this many sigmas is remarked."""

BY_CHANCE = 1e-6
"""Share of right models whose chi-square is larger than what is taken for a fit. A wrong minimum
of the study has a spread of 1.86, which no chance gives; where sigmas are too small, all starts are
tried, which takes time and does no harm."""

MOST_REFINEMENTS = 4

OTHER_STARTS = 6
"""First poses, drawn at random, that are tried beside the believed one."""

MOST_OUTLYING = 0.05
"""And until outliers are no larger share of what was measured beyond what is unknown."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """What a log told of a robot.

    Attributes:
        task: What was asked.
        log: The log.
        result: What was found.
        mount: The camera's mounting, if there are images.
        remarks: What should be known of it, in words.
    """

    task: CalibrationTask
    log: CalibrationLog
    result: CalibrationResult
    mount: str | None
    remarks: tuple[str, ...]


def calibrate(
    task: CalibrationTask, log: CalibrationLog, say: Callable[[str], None] = lambda words: None
) -> Calibration:
    """Calibrates a robot.

    Args:
        task: What is asked.
        log: What was measured.
        say: Told what is done now.

    Raises:
        CalibrationError: The log does not hold, or does not tell, what is asked; names it.
    """
    say("Looking for where the poses were")
    prepared = prepare(task, log)
    if log.poses is not None and prepared.tracked is None:
        prepared = with_tracker(prepared, _begun(prepared, prepared.first)[1])
    check_clock(prepared)
    best: CalibrationResult | None = None
    starts = [prepared.first, *_other_starts(prepared)]
    for number, first in enumerate(starts):
        say(f"Calibrating, start {number + 1} of {len(starts)}")
        try:
            found = _refined(prepared, _program(prepared, first).Solve(task.outliers))
        except CalibrationError:
            if best is None and number == len(starts) - 1:
                raise
            continue
        if best is None or _worth(found) < _worth(best):
            best = found
        if _fits(best):
            break
    assert best is not None
    remarks = list(log.remarks)
    if best.degrees > 0 and best.spread() > MISFIT_STARTS:
        remarks.append(
            f"residuals are {best.spread():.3g} times what sigmas say; standard deviations are as "
            "much too small, or something that was not asked for is off"
        )
    return Calibration(task, log, best, prepared.mount, tuple(remarks))


def _fits(result: CalibrationResult) -> bool:
    """Whether nothing tells that there is a better minimum elsewhere."""
    few = len(result.outliers) <= MOST_OUTLYING * result.degrees
    usual = float(chi2.isf(BY_CHANCE, max(result.degrees, 1)))
    return result.status == "converged" and result.chi_square < usual and few


def _refined(prepared: Prepared, found: CalibrationResult) -> CalibrationResult:
    """The same from poses that are sought anew with what was found of the winches, while better.

    What was counted from an unknown start puts some poses into wrong minima at first.
    """
    for _ in range(MOST_REFINEMENTS if found.model.length_offset.any() else 0):
        if _fits(found):
            break
        again = _program(prepared, found.stations.poses()[0], found.model).Solve(
            prepared.task.outliers
        )
        if _worth(again) >= _worth(found):
            break
        found = again
    return found


def _worth(result: CalibrationResult) -> float:
    """Chi-square with a cost for each outlier, so that dropping rows is no way to fit."""
    return result.chi_square + 16.0 * len(result.outliers)


def _guess_tensions(prepared: Prepared, poses: list[RigidTransform]) -> Array:
    """Tensions where they were measured, else those that hold the platform nearly."""
    robot, log = prepared.task.robot, prepared.log
    count, m = len(poses), prepared.model.cables.count
    share = robot.platform.mass * robot.gravity / m
    guess = np.full((count, m), share)
    for k, X_WP in enumerate(poses):
        try:
            found = distribute(tension_problem(robot, X_WP), "quadratic_program").tensions
        except CdprError:  # a guess outside of the frame, or where the platform is singular
            continue
        if np.isfinite(found).all():
            guess[k] = np.maximum(found, 0.01 * share)
    if log.tensions is not None:
        guess = np.where(np.isfinite(log.tensions), log.tensions, guess)
    return guess


Grow = Callable[[CalibrationProgram, Array | None, float], CalibrationProgram]
"""Adds to a program what winches measured, with guesses of tensions, or None where the platform
need not rest, and by how much sigmas are larger than asked."""


def _begun(
    prepared: Prepared, first: RigidTransform, known: CalibrationModel | None = None
) -> tuple[CalibrationModel, list[RigidTransform], Grow]:
    """The model with guesses of where counting began, the poses that follow, what was measured.

    Where it is known where winches and swivels began to count, from there.
    """
    task, log, robot = prepared.task, prepared.log, prepared.task.robot
    model, sigmas, planar = prepared.model, task.sigmas, task.robot.is_planar()
    poses = prepared.tracked
    seed = next((X for X in poses or () if X is not None), first)
    start = None if prepared.lengths is None else first_readings(prepared.lengths)
    asked = CalibrationProgram(model, [first] * log.count, (), planar)
    free = asked.layout.select(prepared.unknown_of_robot())
    offsets = free[asked.layout.slices["length_offsets"]]
    unsure = known is None and bool(offsets.any()) and "length_offsets" not in task.priors
    if known is not None:
        model = replace(model, length_offset=known.length_offset, swivel_offset=known.swivel_offset)
    elif start is not None and unsure:
        # Where winches began to count is not known: as if that had been at the first pose.
        at = Point(model, Stations.at([seed])).numbers[0, :, 0]
        guess = np.where(offsets, at - start, 0.0)
        model = replace(model, length_offset=guess)
    if log.swivels is not None and known is None:
        angle = Point(model, Stations.at([seed])).numbers[0, :, 2]
        model = replace(model, swivel_offset=angle - first_readings(log.swivels))
    strain = None
    if log.tensions is not None:
        strain = np.nan_to_num(log.tensions) / robot.stiffness()

    def grown(
        program: CalibrationProgram, tensions: Array | None, loose: float
    ) -> CalibrationProgram:
        if prepared.lengths is not None and prepared.sigma is not None:
            program.AddLengths(prepared.lengths, loose * prepared.sigma, start, strain)
        if log.swivels is not None:
            program.AddSwivels(log.swivels, loose * sigmas.swivels)
        if tensions is not None:
            weight = robot.platform.mass * robot.gravity_vector()
            com = robot.center_of_mass()
            program.AddRest(weight, com, sigmas.moments, sigmas.forces, tensions)
            if log.tensions is not None:
                share = sigmas.tensions_share * np.nan_to_num(np.abs(log.tensions))
                program.AddTensions(log.tensions, np.hypot(sigmas.tensions, share))
        return program

    return model, _guessed(prepared, model, grown, seed, unsure=unsure), grown


def _program(
    prepared: Prepared, first: RigidTransform, known: CalibrationModel | None = None
) -> CalibrationProgram:
    """The program, with poses and tags guessed from a first pose."""
    task, log, poses = prepared.task, prepared.log, prepared.tracked
    sigmas, planar = task.sigmas, task.robot.is_planar()
    model, at_rows, grown = _begun(prepared, first, known)
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
    program = CalibrationProgram(model, at_rows, prepared.unknown, planar)
    tensions = _guess_tensions(prepared, at_rows) if prepared.rest else None
    grown(program, tensions, 1.0)
    if log.poses is not None:
        program.AddTrackedPoses(log.poses, sigmas.turn, sigmas.place)
    if prepared.targets:
        assert prepared.pinhole is not None
        order = [tag for tag in model.tags if tag in prepared.targets]
        uv = np.stack([log.corners[tag] for tag in order], axis=1)
        points = {tag: prepared.targets[tag].points for tag in order}
        program.AddTagCorners(points, uv, sigmas.corners, prepared.pinhole)
    for name, std in prepared.priors.items():
        program.AddPrior([name], std)
    return program


def _guessed(
    prepared: Prepared,
    model: CalibrationModel,
    grown: Grow,
    seed: RigidTransform,
    *,
    unsure: bool,
) -> list[RigidTransform]:
    """Poses one after the other; where all are tracked, those."""
    log, robot, poses = prepared.log, prepared.task.robot, prepared.tracked
    if poses is not None and all(X is not None for X in poses):
        return [X for X in poses if X is not None]
    count, planar = log.count, robot.is_planar()
    # Balance is hard to follow from afar; it is asked where lengths and swivels are too few.
    m = prepared.model.cables.count
    told = m * ((prepared.lengths is not None) + (log.swivels is not None))
    rest = prepared.rest and told < (3 if planar else 6)
    tensions = _guess_tensions(prepared, [seed] * count) if rest else None
    trial = grown(CalibrationProgram(model, [seed] * count, (), planar), tensions, 1.0)
    found = guessed_stations(
        model, trial.terms, count, seed, tensions=tensions, planar=planar, sure=not unsure
    )
    return found.poses()


def _other_starts(prepared: Prepared) -> list[RigidTransform]:
    """Further first poses, where nothing but winches tells where the platform is."""
    log = prepared.log
    if log.poses is not None or prepared.targets:
        return []
    frame, X = prepared.task.robot.frame, prepared.first
    random = np.random.default_rng(0)
    size = 0.25 * (np.asarray(frame.upper) - np.asarray(frame.lower))
    starts = []
    for _ in range(OTHER_STARTS):
        turn = pose_from_angles(np.zeros(3), random.uniform(-0.3, 0.3, 3)).rotation()
        place = np.clip(X.translation() + size * random.uniform(-1, 1, 3), frame.lower, frame.upper)
        Y = RigidTransform(X.rotation() @ turn, place)
        if pose_error(X, Y)[0] > 0.0:
            starts.append(Y)
    return starts
