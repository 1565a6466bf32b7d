"""A robot's constants from measurements at poses of its platform: the verb `calibrate`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter

from cdpr_drake.analyses.fits.fit import (
    MISFIT,
    Fit,
    Groups,
    Priors,
    Unknown,
    group_names,
    kept_fit,
    log_of,
    notes_table,
)
from cdpr_drake.analyses.fits.prediction import (
    EACH,
    NEXT_POSES,
    HeldOut,
    held_groups,
    next_poses,
    predicted,
)
from cdpr_drake.analyses.fits.rest_log import at_rest
from cdpr_drake.analyses.fits.robots import calibrated_robot, with_machine_lines
from cdpr_drake.analyses.fits.setup import (
    HOMING,
    CalibrationTask,
    Setup,
    Sigmas,
    default_unknown,
    is_homing,
    prepare,
    with_tracker,
)
from cdpr_drake.analyses.fits.starts import BestFit, Tie, best_of_starts
from cdpr_drake.analyses.fits.tags import TagPlace, read_tags
from cdpr_drake.analyses.fits.verdict import (
    doubts,
    impossible_poses,
    misfits,
    turned_sensors,
    turned_where_lost,
    with_enlarged_deviations,
)
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.result import Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Formats,
    InputFile,
    OutFolder,
    PoseWord,
    RobotWord,
    Switch,
    named_values,
    one_of,
    pose,
    whole,
    whole_pair,
    words,
)
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.fit_groups import GroupFault
from cdpr_drake.calibration.parameters import GROUPS
from cdpr_drake.calibration.result import CalibrationResult, Outlier
from cdpr_drake.errors import CalibrationError, accepted_names
from cdpr_drake.formats.robot_exchange import FIRMWARES, export_robot
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.file_kinds import firmware_of
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_pose

Say = Callable[[str], None]

LOST = ("pose ", "search: ", "start: ")
"""Beginnings of errors of which a sensor's sign may be the reason."""

MOST_OUTLIERS = 10
"""Outliers and ties that the terminal names; results.json has all."""

LEAST_IMAGE = 16
"""Edge of an image [px]."""

MOST_NEXT = 200
"""Poses that are proposed at most."""

UNKNOWN_ZERO = (
    "its motor angles count from somewhere unknown; give the pose at which they were zero with zero"
)
"""What is often missing if a log with motor angles is refused."""


def _image_size(word: str) -> tuple[int, int]:
    size = whole_pair(word)
    if min(size) < LEAST_IMAGE:
        raise ValueError(word)
    return size


Values = Mapping[str, float] | None
HomeOrPose = Annotated[
    Any,
    words(lambda word: word if word == "home" else pose(word),
          "home, x,y,z [m] or x,y,z,phi,theta,psi [m, deg]", "home|X,Y,Z[,PHI,THETA,PSI]"),
]  # fmt: skip
ImageSize = Annotated[
    tuple[int, int] | None, words(_image_size, "width x height, as 640x480 [px]", "WIDTHxHEIGHT")
]
NextCount = Annotated[int | None, whole(1, MOST_NEXT, "COUNT", "--next")]


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibration, and what should be known of it.

    Attributes:
        setup: What was measured; without rows that were held out.
        result: The calibration.
        misfit: Reasons why it is no fit, in words; empty if it is one.
        remarks: Further sentences.
        ties: Poses that fit as well elsewhere.
        groups: Groups of measurements that do not agree with the others.
        held: Rows that were not fitted but predicted; None: all were fitted.
    """

    setup: Setup
    result: CalibrationResult
    misfit: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    ties: tuple[Tie, ...] = ()
    groups: tuple[GroupFault, ...] = ()
    held: HeldOut | None = None


@verb()
def calibrate(
    robot: RobotWord, log: InputFile, *, unknown: Groups | None = None, priors: Priors = None,
    sigmas: Annotated[Values, named_values([f.name for f in fields(Sigmas)], "--sigma")] = None,
    bounds: Annotated[Values, named_values(name="--bound")] = None,
    tag_size: float | None = None, tags: InputFile = None, mount: str | None = None,
    image_size: ImageSize = None, start: PoseWord = None, zero: HomeOrPose = None,
    rest: bool | None = None, tracker_late: float | None = None, hold_out: str | None = None,
    keep_outliers: Switch = False, propose: NextCount = None,
    export: Annotated[str | None, one_of(FIRMWARES)] = None, folder: OutFolder = None,
    overwrite: Switch = False, formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Fit:  # fmt: skip
    """Finds a robot's constants in a log of what was measured at poses of its platform.

    A row of LOG is a pose. Columns: time_s; C1_length_m ... or C1_motor_angle_rad; x_m, y_m, z_m
    alone, or with qw, qx, qy, qz, or phi_deg, theta_deg, psi_deg, or rx_rad, ry_rad, rz_rad, or
    roll_deg, pitch_deg, yaw_deg, of a tracker; tag0_u1_px, tag0_v1_px to tag0_u4_px, tag0_v4_px,
    corners in the image of the camera on the platform; C1_tension_n; C1_swivel_rad; roll_deg,
    pitch_deg, yaw_deg without a position, of an inclinometer or IMU on the platform. Positions
    alone are of a tracker that tells no rotation. Cables go by name or number, units by ending, as
    mm, deg, ms, kn; empty cells were not measured; columns that are not used are named.

    --unknown: GROUPS, or names such as C3.exit_point.z, also with \\* and ?. Tags without a place
    are unknown in any case. Writes robot.yaml, which scenarios take as
    perturbations.believed_robot, results.json and figures. The exit code is 2 where the log cannot
    tell what is asked, 6 where what was found does not fit what was measured: status misfit, with
    the reasons and the largest residuals.

    Args:
        robot: Robot by name or file, as it is believed.
        log: Log, text with columns, or any other that cdpr import-log reads.
        unknown: Groups and names of parameters; default: exit_points,anchor_points, of a point
            mass exit_points, of a robot with fewer cables than degrees of freedom and no tracker
            the zeros of its sensors.
        priors: Standard deviations known beforehand, as exit_points=0.01 [m, rad, -].
        sigmas: Standard deviations of measurements, as lengths=0.001,corners=0.2: SIGMAS [m, rad,
            px, N, N m; shares -].
        bounds: Largest change of parameters, as tracker.[xyz]=0.001 [m, rad, -].
        tag_size: Edge of all tags [m].
        tags: Table of tags: tag, size_m; where known x_m ... psi_deg in W, sigma_m, sigma_deg; in
            Python also `TagPlace` by number.
        mount: Mounting of the camera; default: the first on the platform.
        image_size: Width x height of images [px]; default: as in the camera's data sheet.
        start: Approximate pose of the first row [m, deg]; default: home.
        zero: Pose at which lengths or motor angles were zero [m, deg]; default: they count from
            anywhere.
        rest: The platform rested in all rows, or did not; default: the log tells. Of a log with
            times the means over rows at rest are fitted.
        tracker_late: Delay of the tracker's poses [s]; default: none, which is checked.
        hold_out: Tracked rows to predict and not to fit: a number of rows, rows as 100-160,200, or
            each, which repeats the calibration without each one of them.
        keep_outliers: Count every measurement as it is.
        propose: Also propose so many poses that would tell most next, in next_poses.csv, which cdpr
            plan --path and cdpr calibrate-campaign --poses-from take.
        export: Also write the robot as lines of a firmware's configuration, with standard
            deviations; default: if the robot's file is one.
        folder: Results folder; default: a new one below runs/; in Python nothing is kept.
        overwrite: Replace other results in the folder.
        formats: Formats of the figures' files.
        follow: Who follows.

    Raises:
        CalibrationError: The log does not hold, or does not tell, what is asked; names it.
        LogFileError: The log cannot be read.
        OutputFolderError: The folder holds other results or files, or cannot be written.
    """
    loaded = as_robot(robot, "calibrate")
    if tags is not None and tag_size is not None:
        raise CalibrationError("tag_size: found beside tags; accepted: one of them")
    log = log_of(loaded, log, tracker_late)
    names = default_unknown(loaded, log) if unknown is None else group_names(unknown)
    sigmas = dict(sigmas or {})
    for name in sigmas:
        if name not in vars(HOMING):
            raise CalibrationError(f"sigmas: found {name!r}; {accepted_names(name, vars(HOMING))}")
    homing = unknown is None and is_homing(loaded, log)
    task = CalibrationTask(
        robot=loaded, log=log, unknown=names, priors=dict(priors or {}), bounds=dict(bounds or {}),
        sigmas=replace(HOMING if homing else Sigmas(), **sigmas),
        tags=_tag_places(list(log.corners), tags, tag_size), mount=mount, image_size=image_size,
        start=_pose(loaded, start), zero=_pose(loaded, zero), rest=rest,
        outliers=not keep_outliers,
    )  # fmt: skip
    if propose is not None and not 1 <= propose <= MOST_NEXT:
        raise CalibrationError(f"propose: found {propose}; accepted: 1 to {MOST_NEXT}")
    if export is not None:
        export_robot(loaded, export)  # refuses robots that it cannot hold
    elif isinstance(robot, str | Path):
        export = firmware_of(Path(robot))

    def work() -> Fit:
        try:
            calibration = fit_robot(task, hold_out, follow.doing)
        except CalibrationError as problem:
            if log.angles is not None and task.zero is None:
                problem.add_note(UNKNOWN_ZERO)
            raise
        fit = calibration_fit(calibration)
        if export is not None:
            fit = with_machine_lines(fit, export)
        return fit if propose is None else with_next_poses(fit, propose, follow.doing)

    cameras = [load_camera(camera.model) for camera in loaded.cameras] if log.corners else []
    arguments = {
        **vars(task), "verb": "calibrate", "cameras": cameras, "hold_out": hold_out,
        "propose": propose, "export": export,
    }  # fmt: skip
    return kept_fit(f"calibrate-{loaded.name}", arguments, work, folder, overwrite, formats, follow)


_SIGMAS = ", ".join(
    f.name + ("" if f.default is None else f" ({f.default:g})") for f in fields(Sigmas)
)
calibrate.__doc__ = (
    (calibrate.__doc__ or "").replace("GROUPS", ", ".join(GROUPS)).replace("SIGMAS", _SIGMAS)
)


def _pose(robot: Robot, word: Any) -> Any:
    """A pose X_WP of what users write; None stays."""
    if isinstance(word, str) and word == "home":
        return robot.home.transform()
    return None if word is None else as_pose(robot, word)


def _tag_places(seen: Sequence[int], tags: Any, size: float | None) -> dict[int, TagPlace]:
    if size is None:
        return read_tags(Path(tags)) if isinstance(tags, str | Path) else dict(tags or {})
    if not 0.0 < size < 1e3:
        raise CalibrationError(f"tag_size: found {size:g}; accepted: > 0 [m]")
    return dict.fromkeys(seen, TagPlace(size))


def fit_robot(
    task: CalibrationTask, hold_out: str | int | None = None, say: Say = lambda words: None
) -> Calibration:
    """Calibrates a robot; the result's status is `MISFIT` if it does not fit its measurements.

    Args:
        task: What is unknown, and what was measured.
        hold_out: Rows that are not fitted but predicted, see `held_groups`; None: none.
        say: Hears what is done.

    Raises:
        CalibrationError: The log does not hold, or does not tell, what is asked; names it.
    """
    task = at_rest(task)
    if hold_out is not None:
        return _held_out(task, hold_out, say)

    def refitted(trial: CalibrationTask) -> BestFit:
        """A fit from one start, to try what may be wrong of the log."""
        say("Looking for signs that are turned")
        return _best_fit(trial, others=False)[1]

    try:
        setup, best = _best_fit(task, say)
    except CalibrationError as problem:
        if str(problem).startswith(LOST):
            turned = turned_where_lost(task, refitted)
            if turned:
                raise CalibrationError(f"{problem}; {turned[0]}") from problem
        raise
    result, groups = best.result, best.groups
    up = setup.first.rotation().matrix()[:, 2]
    misfit = (*impossible_poses(task.robot, result, up)[0], *misfits(result, groups))
    if misfit:
        misfit = (*turned_sensors(task, best, refitted), *misfit)
        result = replace(result, status=MISFIT)
    result, enlarged = with_enlarged_deviations(result, groups)
    remarks = doubts(setup, best, enlarged)
    return Calibration(setup, result, misfit, tuple(remarks), best.ties, groups)


def _best_fit(
    task: CalibrationTask, say: Say = lambda words: None, others: bool = True
) -> tuple[Setup, BestFit]:
    """The best of all starts, or of the believed one alone."""
    say("Looking for where the poses were")
    setup = with_tracker(prepare(task))
    return setup, best_of_starts(setup, say, others)


def _held_out(task: CalibrationTask, hold_out: str | int, say: Say) -> Calibration:
    """A calibration on some rows, the others predicted; or on all, each held out once."""
    whole_log = prepare(task)
    errors = []
    groups = held_groups(hold_out, task.log, whole_log.zeroed and task.zero is not None)
    for number, group in enumerate(groups):
        say(f"Calibrating without rows, {number + 1} of {len(groups)}")
        kept = np.setdiff1d(np.arange(task.log.count), group)
        calibration = fit_robot(replace(task, log=task.log.only(kept)))
        errors.append(predicted(whole_log, calibration.result, kept, group))
    if len(groups) > 1 or str(hold_out) == EACH:
        calibration, kept = fit_robot(task, None, say), kept[:0]
    distances, angles = np.concatenate(errors).T
    held = HeldOut(np.concatenate(groups), distances, angles, kept)
    return replace(calibration, held=held)


def calibration_fit(calibration: Calibration) -> Fit:
    """A calibration as a `Fit`."""
    setup, result = calibration.setup, calibration.result
    robot, left = calibrated_robot(setup.task.robot, result, setup.mount)
    remarks = (*calibration.remarks, *left)
    residuals = {
        kind: {"count": one.count, "rms_sigmas": one.rms, "largest_sigmas": one.largest,
               "dropped": one.dropped}
        for kind, one in result.residuals.items()
    }  # fmt: skip
    values = zip(result.names, result.units, result.std, result.values, strict=True)
    fit = Fit(
        title=f"Calibration of {robot.name}", model=robot, status=result.status,
        unknowns=tuple(Unknown(n, unit, float(s), change=float(x)) for n, unit, s, x in values),
        spread=result.spread(), misfit=calibration.misfit, covariance=result.covariance,
        held_out=calibration.held, remarks=remarks, residuals=residuals,
        details=_details(calibration, residuals), shown=tuple(_tables(calibration, remarks)),
        result=result, source=calibration,
    )  # fmt: skip
    drawings = {
        "calibration": lambda: _figure("fit_figure", fit, grouped(result)),
        "correlation": lambda: _figure("correlation_figure", fit),
    }
    motion = setup.freedom.motion
    if calibration.held is not None or not (motion.is_free or motion.is_horizontal_body):
        drawings["rows"] = lambda: _figure("row_figure", fit)
    return replace(fit, drawings=drawings)


def _figure(name: str, *arguments: Any) -> Any:
    from cdpr_drake.analyses.fits import figures  # and with it matplotlib

    return getattr(figures, name)(*arguments)


def _details(calibration: Calibration, residuals: Mapping[str, Any]) -> dict[str, Any]:
    """What results.json has of a calibration alone; rows count from 1, poses from 0."""
    setup, result = calibration.setup, calibration.result
    task, model, names = setup.task, result.model, result.names
    details: dict[str, Any] = {
        "robot": task.robot.name,
        "log": str(task.log.path),
        "misfit": list(calibration.misfit),
        "groups": [
            {
                "test": group.test, "measurement": group.quantity,
                "rows": [row + 1 for row in group.rows], "size": finite(group.size),
                "std": finite(group.std), "probability": group.probability,
                "poses_move_deviations": finite(group.moves), "misfit": group.counts,
                "words": group.words,
            }
            for group in calibration.groups
        ],
        "robust_cost": finite(result.robust_cost),
        "largest_residuals": [
            {
                "row": o.pose + 1, "measurement": o.what, "residual": o.residual,
                "unit": o.unit, "sigmas": o.sigmas,
            }
            for o in result.largest
        ],
        "ties": [
            {
                "row": tie.pose + 1, "X_WP": pose_row(tie.X_WP).tolist(),
                "distance_m": tie.distance, "angle_rad": tie.angle, "cost_more": tie.more,
            }
            for tie in calibration.ties
        ],
        "unknown": list(task.unknown),
        "priors": dict(task.priors),
        "sigmas": {key: value for key, value in vars(task.sigmas).items() if value is not None},
        "poses": task.log.count,
        "chi_square": finite(result.chi_square),
        "degrees_of_freedom": result.degrees,
        "residuals": residuals,
        "gauge": list(result.gauge),
        "frames_hardly_told": list(result.loose),
        "known_from_priors_alone": list(result.prior_only),
        "length_offsets_m": model.length_offset.tolist(),
        "length_scales": model.length_scale.tolist(),
        "swivel_offsets_rad": model.swivel_offset.tolist(),
        "tracker_X_WK": pose_row(model.X_WK).tolist(),
        "marker_X_PM": pose_row(model.X_PM).tolist(),
        "camera_X_PC": pose_row(model.X_PC).tolist(),
        "tags_X_WT": {str(tag): pose_row(X).tolist() for tag, X in model.tags.items()},
        "poses_X_WP": [pose_row(X).tolist() for X in result.stations.poses()],
        "outliers": [
            {"pose": o.pose, "what": o.what, "residual": o.residual, "sigmas": o.sigmas}
            for o in result.outliers
        ],
        "steps": result.steps,
        "seconds": result.seconds,
    }  # fmt: skip
    if any("drum_radius" in name for name in names):
        usual = task.robot.winch.drum_radius
        details["drum_radii_m"] = [
            (usual if cable.drum_radius is None else cable.drum_radius)
            + model.common_drum_radius + float(change)
            for cable, change in zip(task.robot.cables, model.drum_radius, strict=True)
        ]  # fmt: skip
    for name, unit in (("common_length_offset", "_m"), ("common_length_scale", "")):
        if name in names:
            details[name + unit] = getattr(model, name)
    if any(name.startswith("tilt_zero") for name in names):
        details["tilt_zeros_rad"] = model.tilt_zero.tolist()
    if "clock" in names:
        details["tracker_late_s"] = model.clock
    if task.zero is not None:
        details["zero_X_WP"] = pose_row(task.zero).tolist()
    if task.bounds:
        details |= {"bounds": dict(task.bounds), "at_bounds": dict(result.at_bounds)}
    if calibration.held is not None:
        details["held_out"] = calibration.held.as_dict()
    return details


def grouped(result: CalibrationResult) -> list[tuple[str, str, Array, Array]]:
    """Group, unit, changes and standard deviations of the unknown parameters."""
    rows = []
    for key, group in GROUPS.items():
        for unit in dict.fromkeys(group.units):
            mine = [
                k for k, name in enumerate(result.names)
                if group.single in name.split(".") and result.units[k] == unit
                and (group.owner == "tag") == name.startswith("tag")
            ]  # fmt: skip
            if mine:
                rows.append((key, unit, result.values[mine], result.std[mine]))
    return rows


def _tables(calibration: Calibration, remarks: Sequence[str]) -> list[Table]:
    """Fit, reasons why it is none, parameters by group, notes, outliers, ties."""
    result, ties = calibration.result, calibration.ties
    task = calibration.setup.task
    tables = [
        Table(
            f"{task.robot.name}: {result.status}, {task.log.count} poses, "
            f"residuals {result.spread():.2f} sigmas",
            ("measured", "numbers", "rms [sigmas]", "largest [sigmas]", "dropped"),
            [(kind, str(one.count), f"{one.rms:.2f}", f"{one.largest:.2f}", str(one.dropped))
             for kind, one in result.residuals.items()],
        )
    ]  # fmt: skip
    headings = ("row", "measurement", "off by", "sigmas")
    if calibration.misfit:
        why = "; ".join(words for words in calibration.misfit if not words.startswith("largest: "))
        tables.append(Table(f"Does not fit: {why}", headings, _off_rows(result.largest)))
    tables.append(
        Table(
            "Parameters", ("group", "unit", "change, rms", "std, median", "std, largest"),
            [(group, unit, f"{np.sqrt(np.mean(values**2)):.3g}", f"{np.median(std):.2g}",
              f"{np.max(std):.2g}")
             for group, unit, values, std in grouped(result)],
        )
    )  # fmt: skip
    notes = [("frames are not told", words) for words in result.gauge]
    notes += [("frames are hardly told", words) for words in result.loose]
    notes += [("from the prior alone", words) for words in result.prior_only]
    if calibration.held is not None:
        notes.append(("held out", calibration.held.words()))
    tables += notes_table(remarks, notes)
    if result.outliers:
        title = f"Outliers, {len(result.outliers)}, which did not count"
        tables.append(Table(title, headings, _off_rows(result.outliers[:MOST_OUTLIERS])))
    if ties:
        tables.append(
            Table(
                f"Other poses of rows that fit as well, {len(ties)}",
                ("row", "away [mm]", "turned [deg]", "cost more"),
                [(str(tie.pose + 1), f"{1e3 * tie.distance:.3g}",
                  f"{np.degrees(tie.angle):.3g}", f"{tie.more:.2g}")
                 for tie in ties[:MOST_OUTLIERS]],
            )
        )  # fmt: skip
    return tables


def _off_rows(outliers: Sequence[Outlier]) -> list[tuple[str, str, str, str]]:
    return [
        (str(o.pose + 1), o.what, f"{o.residual:.4g} {o.unit}", f"{o.sigmas:.3g}") for o in outliers
    ]


def with_next_poses(fit: Fit, count: int, say: Say = lambda words: None) -> Fit:
    """A calibration with the poses that would tell most next.

    Raises:
        CalibrationError: The calibrated robot rests at too few poses.
    """
    say("Looking for poses that would tell most")
    proposal = next_poses(fit.source.setup, fit.result, count)
    return fit.with_more(
        [proposal.table()], details={"next_poses": proposal.as_dict()},
        texts={NEXT_POSES: proposal.text()},
    )  # fmt: skip
