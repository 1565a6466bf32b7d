"""From a log and what is asked to a program, and to what it found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.calibration.log_file import CalibrationLog
from cdpr_drake.analyses.calibration.robots import calibration_model, find_mount
from cdpr_drake.arrays import Array
from cdpr_drake.calibration import (
    WORSE,
    CalibrationModel,
    CalibrationProgram,
    CalibrationResult,
    Point,
    Stations,
    first_readings,
    guessed_stations,
    guessed_tags,
    poses_by_tags,
    tracker_shift,
    with_tags,
)
from cdpr_drake.errors import CalibrationError, CdprError
from cdpr_drake.models import Robot, load_camera, tension_problem
from cdpr_drake.spatial import pose_error, pose_from_angles
from cdpr_drake.tensions import distribute
from cdpr_drake.vision import Pinhole, PointTarget, TagTarget

TagPlaces = dict[int, tuple[float, RigidTransform | None]]

MISFIT_STARTS = 2.0
"""Starts of a search are tried until the fit is as good as this many sigmas."""

MOST_REFINEMENTS = 4

OTHER_STARTS = 6
"""First poses, drawn at random, that are tried beside the believed one."""

MOST_OUTLYING = 0.05
"""And until outliers are no larger share of what was measured beyond what is unknown."""


@dataclass(frozen=True)
class Sigmas:
    """Standard deviations of what is measured.

    Attributes:
        lengths: Of a cable's length [m].
        lengths_share: Of it, besides, over the length [-].
        place: Of a coordinate of a tracked position [m].
        turn: Of a tracked rotation about each axis [rad].
        corners: Of a coordinate of a corner [px].
        tensions: Of a tension [N].
        tensions_share: Of it, besides, over the tension [-].
        swivels: Of a swivel angle [rad].
        moments: What moments may miss of the balance at rest [N m].
        forces: What forces may miss of it [N].
    """

    lengths: float = 1e-3
    lengths_share: float = 0.0
    place: float = 1e-3
    turn: float = 2e-3
    corners: float = 0.2
    tensions: float = 1.0
    tensions_share: float = 0.0
    swivels: float = 2e-3
    moments: float = 0.05
    forces: float = 0.5


@dataclass(frozen=True, eq=False)
class CalibrationTask:
    """What is asked of a log.

    Attributes:
        robot: The robot as it is believed.
        unknown: Groups and names of parameters; the poses of tags of unknown place, and zeros of
            swivel angles, are unknown in any case.
        priors: Standard deviations by group or name, in their units.
        sigmas: Of what was measured.
        tags: Edges of tags [m] and poses X_WT of those whose place is known, by their numbers.
        mount: The camera's mounting; None: the first on the platform.
        image_size: Width and height [px]; None: those of the camera's data sheet.
        start: Pose where the platform is believed to have been in the first row; None: home.
        rest: Whether the platform rested in all rows; None: where tensions or swivel angles, and
            neither tracker nor tags, were measured.
        outliers: Whether outliers are sought.
    """

    robot: Robot
    unknown: tuple[str, ...]
    priors: dict[str, float] = field(default_factory=dict)
    sigmas: Sigmas = field(default_factory=Sigmas)
    tags: TagPlaces = field(default_factory=dict)
    mount: str | None = None
    image_size: tuple[int, int] | None = None
    start: RigidTransform | None = None
    rest: bool | None = None
    outliers: bool = True


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
    prepared = _prepare(task, log)
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
    return result.status == "converged" and result.spread() < MISFIT_STARTS and few


def _refined(prepared: _Prepared, found: CalibrationResult) -> CalibrationResult:
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


@dataclass(frozen=True, eq=False)
class _Prepared:
    """A log and a task, checked."""

    task: CalibrationTask
    log: CalibrationLog
    model: CalibrationModel
    lengths: Array | None
    sigma: Array | None
    first: RigidTransform
    rest: bool
    mount: str | None
    pinhole: Pinhole | None
    targets: dict[int, PointTarget]
    unknown: tuple[str, ...]


def _prepare(task: CalibrationTask, log: CalibrationLog) -> _Prepared:
    robot, sigmas = task.robot, task.sigmas
    lengths = log.lengths
    if lengths is None and log.angles is not None:
        lengths = robot.drum().paid_out(log.angles)
    if lengths is None and log.swivels is None:
        raise CalibrationError(
            f"{log.path}: cable lengths: found none; accepted: columns such as C1_length_m, or "
            "motor angles such as C1_motor_angle_rad"
        )
    mount, pinhole = None, None
    targets: dict[int, PointTarget] = {}
    if log.corners:
        mount = task.mount or next((m.name for m in robot.cameras if m.parent == "platform"), None)
        if mount is None:
            raise CalibrationError(f"mount: found none on the platform of {robot.name}")
        camera = load_camera(find_mount(robot, mount).model)
        width, height = task.image_size or (camera.width, camera.height)
        pinhole = camera.pinhole(width, height)
        _check_images(log, width, height)
        missing = [str(tag) for tag in log.corners if tag not in task.tags]
        if missing:
            raise CalibrationError(
                f"tags: found no size of tag {', '.join(missing)}, which {log.path} shows; "
                "accepted: --tag-size, or --tags with a row for each"
            )
        targets = {tag: TagTarget(tag, task.tags[tag][0]) for tag in log.corners}
    model = calibration_model(robot, mount)
    unknown = list(task.unknown)
    places = {tag: task.tags[tag][1] for tag in targets}
    known = {tag: X_WT for tag, X_WT in places.items() if X_WT is not None}
    unknown += [f"tag{tag}.*" for tag in places if tag not in known and "tags" not in unknown]
    if log.swivels is not None and "swivel_offsets" not in unknown:
        unknown.append("swivel_offsets")
    blind = log.poses is None and not targets
    rest = task.rest
    if rest is None:
        rest = blind and (log.tensions is not None or log.swivels is not None)
    first = task.start or robot.home.transform()
    seed = next((X for X in log.poses or () if X is not None), first)
    sigma = None
    if lengths is not None:
        # Readings may count from anything: lengths are those at the first pose and what came since.
        whole = Point(model, Stations.at([seed])).numbers[0, :, 0]
        whole = np.abs(whole + lengths - first_readings(lengths))
        sigma = np.hypot(sigmas.lengths, sigmas.lengths_share * whole)
    prepared = _Prepared(
        task, log, with_tags(model, known), lengths, sigma, first, rest, mount, pinhole, targets,
        tuple(unknown),
    )  # fmt: skip
    _check_clock(prepared)
    return prepared


def _check_images(log: CalibrationLog, width: int, height: int) -> None:
    for tag, uv in log.corners.items():
        outside = (
            (uv[..., 0] > width - 0.5) | (uv[..., 1] > height - 0.5) | np.any(uv < -0.5, axis=-1)
        )
        if np.any(outside):
            k = int(np.argmax(np.any(outside, axis=1)))
            u, v = uv[k][outside[k]][0]
            raise CalibrationError(
                f"{log.path}: row {k + 1}: tag {tag}: found a corner at ({u:g}, {v:g}) px; "
                f"accepted: within the image of {width} x {height} px, see --image-size"
            )


def _check_clock(prepared: _Prepared) -> None:
    """Refuses a tracker that is out of sync with the winches."""
    log, poses = prepared.log, prepared.log.poses
    if poses is None or log.time is None or prepared.lengths is None:
        return
    tracked = np.full(prepared.lengths.shape, np.nan)
    seen = [k for k, X in enumerate(poses) if X is not None]
    at = Point(prepared.model, Stations.at([X for X in poses if X is not None]))
    tracked[seen] = at.numbers[:, :, 0]
    shift, better = tracker_shift(log.time, prepared.lengths, tracked)
    step = float(np.median(np.diff(log.time)))
    if better > WORSE and abs(shift) > 0.25 * step:
        late = "late" if shift > 0.0 else "early"
        raise CalibrationError(
            f"{log.path}: tracker: found it {abs(shift):.4g} s {late} against the cable lengths, "
            f"which fit {better:.2g} times better with that shift; accepted: the same clock, or "
            f"--tracker-late {shift:.4g}"
        )


def shifted_log(log: CalibrationLog, late: float) -> CalibrationLog:
    """A log whose tracker was late by a time [s]: poses in between are interpolated, the ends left.

    Raises:
        CalibrationError: It has no times or no poses.
    """
    if log.time is None or log.poses is None:
        raise CalibrationError(
            f"{log.path}: found no {'time' if log.time is None else 'poses'} to shift a tracker by"
        )
    seen = [k for k, X in enumerate(log.poses) if X is not None]
    times, known = log.time[seen], [X for X in log.poses if X is not None]
    moved: list[RigidTransform | None] = []
    for t in log.time + late:
        k = int(np.searchsorted(times, t)) - 1
        if not 0 <= k < len(times) - 1:
            moved.append(None)
            continue
        share = (t - times[k]) / (times[k + 1] - times[k])
        X, Y = known[k], known[k + 1]
        turn = X.rotation().inverse() @ Y.rotation()
        angle_axis = turn.ToAngleAxis()
        angle_axis.set_angle(share * angle_axis.angle())
        R = X.rotation().matrix() @ angle_axis.rotation()
        p = X.translation() + share * (Y.translation() - X.translation())
        moved.append(RigidTransform(type(X.rotation()).ProjectToRotationMatrix(R), p))
    return replace(log, poses=moved)


def _guess_tensions(prepared: _Prepared, poses: list[RigidTransform]) -> Array:
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


def _program(
    prepared: _Prepared, first: RigidTransform, known: CalibrationModel | None = None
) -> CalibrationProgram:
    """The program, with poses and tags guessed from a first pose.

    Where it is known where winches and swivels began to count, from there.
    """
    task, log, robot = prepared.task, prepared.log, prepared.task.robot
    model, sigmas, planar = prepared.model, task.sigmas, task.robot.is_planar()
    poses = None if log.poses is None else list(log.poses)
    seed = next((X for X in poses or () if X is not None), first)
    start = None if prepared.lengths is None else first_readings(prepared.lengths)
    asked = CalibrationProgram(model, [first] * log.count, (), planar)
    layout_unknown = [n for n in prepared.unknown if not n.startswith("tag")]
    offsets = asked.layout.select(layout_unknown)[asked.layout.slices["length_offsets"]]
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
            weight, com = robot.platform.mass * robot.gravity, robot.center_of_mass()
            program.AddRest(weight, com, sigmas.moments, sigmas.forces, tensions)
            if log.tensions is not None:
                share = sigmas.tensions_share * np.nan_to_num(np.abs(log.tensions))
                program.AddTensions(log.tensions, np.hypot(sigmas.tensions, share))
        return program

    at_rows = _guessed(prepared, model, grown, seed, unsure=unsure)
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
    if poses is not None:
        program.AddTrackedPoses(poses, sigmas.turn, sigmas.place)
    if prepared.targets:
        assert prepared.pinhole is not None
        order = [tag for tag in model.tags if tag in prepared.targets]
        uv = np.stack([log.corners[tag] for tag in order], axis=1)
        points = {tag: prepared.targets[tag].points for tag in order}
        program.AddTagCorners(points, uv, sigmas.corners, prepared.pinhole)
    for name, std in task.priors.items():
        program.AddPrior([name], std)
    return program


def _guessed(
    prepared: _Prepared,
    model: CalibrationModel,
    grown: Callable[[CalibrationProgram, Array | None, float], CalibrationProgram],
    seed: RigidTransform,
    *,
    unsure: bool,
) -> list[RigidTransform]:
    """Poses one after the other; where all are tracked, those."""
    log, robot = prepared.log, prepared.task.robot
    if log.poses is not None and all(X is not None for X in log.poses):
        return [X for X in log.poses if X is not None]
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


def _other_starts(prepared: _Prepared) -> list[RigidTransform]:
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
