"""The verb replay_log: a recorded run beside a model of its robot.

Lengths are compared with those along the model's cables at the measured pose, shortened by their
stretch where tensions were measured; poses with those that the model has for the measured lengths;
tensions, where there are no more cables than degrees of freedom, with those that carry the weight,
else by the force and moment that they leave on the platform at rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from cyclopts import Parameter
from pydrake.geometry import Box
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.systems.analysis import Simulator

from cdpr_drake.analyses.frame.folder import Folder, results_folder, write_result
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Formats,
    InputFile,
    OutFolder,
    RobotWord,
    Switch,
)
from cdpr_drake.analyses.logs.columns import LENGTH, PARTS, POSITION, QUATERNION, SECONDS
from cdpr_drake.analyses.logs.dialects import AUTO, read_log
from cdpr_drake.analyses.logs.import_log import (
    Axes,
    LogFormat,
    MappingFile,
    Rate,
    Topics,
    Units,
    facts_of,
    unused_facts,
)
from cdpr_drake.analyses.logs.log import Log, refusal
from cdpr_drake.analyses.logs.measurements import bind_log
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.arrays import Array
from cdpr_drake.cables.elastic_law import unstrained_lengths
from cdpr_drake.errors import LogFileError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_row, pose_row
from cdpr_drake.geometry.straight_cables import gravity_wrench
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_motion import HELD
from cdpr_drake.systems.robots.compiled_step import StepRule

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TOLERANCE = 1.0
"""Measured lengths may be off by so much, and still have a pose [m]."""

LEAST_ROWS = 3
"""Rows with a pose and lengths that fit a tracker's frame."""

TABLE, SUMMARY, PAGE = "replay.csv", "summary.json", "replay.html"

MODEL_COLOR = (0.9, 0.6, 0.0, 0.45)
"""Color of the platform as the model has it for the measured lengths."""


class Followed(NamedTuple):
    """The simulated robot, driven with the lengths in q rows of a log: the rows, poses X_WP, shape
    (q, 7), and tensions, shape (q, m) [N]."""

    rows: np.ndarray
    poses: Array
    tensions: Array


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Replay(Result):
    """A run beside its model; rows in which something was not measured have NaN there.

    Attributes:
        robot, log: The robot and the log.
        time: Shape (k,) [s], or numbers of rows where there are no times.
        poses, poses_by_lengths: X_WP as measured, and the model's for the measured lengths, shape
            (k, 7), see `pose_row`; NaN for turns that were not measured.
        lengths, tensions: Measured, lengths also by motor angles, shape (k, m) [m, N].
        predicted_lengths: The model's at the measured poses, shape (k, m) [m].
        predicted_tensions: Those that carry the weight, shape (k, m) [N]; NaN with more cables
            than degrees of freedom.
        unbalanced: What measured tensions and weight leave on the platform, along its degrees of
            freedom, (moment, force), shape (k, n) [N m, N].
        frame: X_WF of the tracker that was fitted; None: it was taken to be W.
        followed: The simulated robot; None: it was not simulated.
        remarks: What binding the log to the robot left out or assumed.
        folder, failed: Results folder or None, and why files were not written, by name.
    """

    robot: Robot
    log: Log
    time: Array
    poses: Array
    poses_by_lengths: Array
    lengths: Array
    predicted_lengths: Array
    tensions: Array
    predicted_tensions: Array
    unbalanced: Array
    frame: RigidTransform | None = None
    followed: Followed | None = None
    remarks: tuple[str, ...] = ()
    folder: Path | None = None
    failed: dict[str, str] = field(default_factory=dict)

    @property
    def length_residuals(self) -> Array:
        """Measured minus predicted, shape (k, m) [m]."""
        return self.lengths - self.predicted_lengths

    @property
    def distances(self) -> Array:
        """Between measured positions and those by lengths, shape (k,) [m]."""
        return np.asarray(np.linalg.norm(self.poses[:, 4:] - self.poses_by_lengths[:, 4:], axis=1))

    @property
    def forces(self) -> Array:
        """What tensions and weight leave, shape (k,) [N]."""
        moments = self.robot.motion_type().num_turns
        return np.asarray(np.linalg.norm(self.unbalanced[:, moments:], axis=1))

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        frame = followed = None
        if self.frame is not None:
            angles = np.degrees(RollPitchYaw(self.frame.rotation()).vector()).tolist()
            frame = {"position_m": self.frame.translation().tolist(), "angles_deg": angles}
        if self.followed is not None:
            rows, apart = self.followed.rows, self.followed_distances()
            followed = {
                "rows": len(rows), "position_error_rms_m": _rms(apart),
                "position_error_largest_m": _most(apart),
                "tension_error_rms_n": _rms(self.followed.tensions - self.tensions[rows]),
            }  # fmt: skip
        numbers: dict[str, Any] = finite({
            "robot": self.robot.name, "log": str(self.log.path), "rows": self.log.rows_summary(),
            "rows_with_pose": int(np.isfinite(self.poses[:, 4]).sum()),
            "rows_with_pose_by_lengths": int(np.isfinite(self.poses_by_lengths[:, 4]).sum()),
            "cables": {cable.name: self._of_cable(k) for k, cable in enumerate(self.robot.cables)},
            "position_by_lengths_rms_m": _rms(self.distances),
            "position_by_lengths_largest_m": _most(self.distances),
            "unbalanced_force_rms_n": _rms(self.forces), "tracker_frame": frame,
            "followed": followed, "remarks": list(self.remarks),
        })  # fmt: skip
        return numbers

    def followed_distances(self) -> Array:
        """Distances of the simulated robot from the measured positions, shape (q,) [m]."""
        assert self.followed is not None
        steps = self.followed.poses[:, 4:] - self.poses[self.followed.rows, 4:]
        return np.asarray(np.linalg.norm(steps, axis=1))

    def _of_cable(self, k: int) -> dict[str, Any]:
        lengths, tensions = self.length_residuals[:, k], self.tensions - self.predicted_tensions
        return {
            "length_offset_m": _mean(lengths),
            "length_residual_rms_m": _rms(lengths - (_mean(lengths) or 0.0)),
            "length_residual_largest_m": _most(lengths),
            "tension_residual_rms_n": _rms(tensions[:, k]),
        }

    def tables(self) -> list[Table]:
        """Rows, residuals by cable, and what became of the platform."""
        numbers = self.as_dict()
        rows = [("rows", self.log.rows_words())]
        if self.followed is not None:
            error = numbers["followed"]["position_error_rms_m"]
            words = "no measured pose" if error is None else f"{1e3 * error:.4g} mm rms"
            rows.append(("simulated", f"follows the log's lengths: {words} from what was"))
        if self.frame is not None:
            rows.append(("tracker", "its frame was fitted to the positions by lengths"))
        if numbers["position_by_lengths_rms_m"] is not None:
            rows.append(("position", f"{1e3 * numbers['position_by_lengths_rms_m']:.4g} mm rms"))
        if numbers["unbalanced_force_rms_n"] is not None:
            rows.append(("force left", f"{numbers['unbalanced_force_rms_n']:.4g} N rms"))
        for name, cable in numbers["cables"].items():
            parts = []
            if cable["length_offset_m"] is not None:
                parts.append(f"length off by {1e3 * cable['length_offset_m']:.2f} mm")
                parts.append(f"{1e3 * cable['length_residual_rms_m']:.2f} mm rms about that")
            if cable["tension_residual_rms_n"] is not None:
                parts.append(f"tension {cable['tension_residual_rms_n']:.3g} N rms")
            rows.append((name, ", ".join(parts) or "nothing to compare"))
        return [Table(f"{self.log.path.name} beside {self.robot.name}", (), rows)]

    def lines(self) -> list[str]:
        """Remarks, and where the results are."""
        lines = [f"note: {remark}" for remark in self.remarks]
        return lines + ([] if self.folder is None else [f"results: {self.folder}"])

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """Residuals of lengths and tensions by cable, distances of positions, over time."""
        return {"residuals": self._draw}

    def _draw(self) -> Figure:
        from cdpr_drake.analyses.frame.figures import draw_curve, panels, phase_of, styled
        from cdpr_drake.palette import nth_look

        def by_cable(residuals: Array) -> dict[str, tuple[Array, Array]]:
            cables = zip(self.robot.cables, residuals.T, strict=True)
            return {cable.name: (self.time, row) for cable, row in cables}

        distances = {"model by lengths": (self.time, 1e3 * self.distances)}
        if self.followed is not None:
            times = self.time[self.followed.rows]
            distances["simulated"] = (times, 1e3 * self.followed_distances())
        tensions = self.tensions - self.predicted_tensions
        residuals = {
            "length, measured\nminus model [mm]": by_cable(1e3 * self.length_residuals),
            "tension, measured\nminus model [N]": by_cable(tensions),
            "distance from the\nmeasured position [mm]": distances,
            "force left by\ntensions, weight [N]": {"at rest": (self.time, self.forces)},
        }
        shown = {
            label: measured for label, rows in residuals.items()
            if (measured := {n: row for n, row in rows.items() if np.isfinite(row[1]).any()})
        }  # fmt: skip
        title = f"{self.log.path.name} beside {self.robot.name}"
        figure, all_axes = panels(len(shown), 1, (9.0, 1.2 + 2.2 * max(len(shown), 1)), title)
        with styled():
            for axes, (label, rows) in zip(all_axes, shown.items(), strict=False):
                for k, (name, (times, values)) in enumerate(rows.items()):
                    phase = phase_of(k, len(rows))
                    draw_curve(axes, times, values, nth_look(k), name, phase=phase)
                axes.set_ylabel(label)
                axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
            all_axes[-1].set_xlabel("time [s]" if self.log.time is not None else "row")
        return figure

    def write(self, folder: Folder) -> None:
        """Writes the table of all rows, and the summary."""
        from cdpr_drake.analyses.reporting.exported_logs import write_columns

        columns = {SECONDS: self.time}
        for k, cable in enumerate(self.robot.cables):
            for name in ("length", "predicted_length", "tension", "predicted_tension"):
                unit = "m" if name.endswith("length") else "n"
                columns[f"{cable.name}_{name}_{unit}"] = getattr(self, f"{name}s")[:, k]
        for prefix, rows in (("", self.poses), ("by_lengths_", self.poses_by_lengths)):
            for k, name in enumerate((*PARTS[QUATERNION], *PARTS[POSITION])):
                columns[f"{prefix}{name}"] = rows[:, k]
        with folder.files() as stage:
            write_columns(stage / TABLE, columns)
        folder.write_json(SUMMARY, self.as_dict())

    def pages(self) -> dict[str, Callable[[Path], object]]:
        """The page that replays the run, if poses of two rows are known."""
        poses = np.where(np.isfinite(self.poses[:, :1]), self.poses, self.poses_by_lengths)
        rows = np.flatnonzero(np.isfinite(poses).all(axis=1))
        if len(rows) < 2:
            return {}
        model = np.where(np.isfinite(self.poses_by_lengths), self.poses_by_lengths, poses)
        shown = {"time": self.time[rows], "X_WP": poses[rows], "X_WP_by_lengths": model[rows],
                 "tensions": np.nan_to_num(self.tensions[rows])}  # fmt: skip
        title = (
            f"{self.log.path.name}: the measured run of {self.robot.name}; orange, where the model "
            "has the platform for the measured lengths"
        )

        def write(path: Path) -> None:
            from cdpr_drake.analyses.visualization.replay import write_replay
            from cdpr_drake.analyses.visualization.shown_things import ShownThing, Surroundings

            size = 1.02 * np.maximum(np.asarray(self.robot.platform.size, float), 0.01)
            thing = ShownThing("model", Box(*size), MODEL_COLOR, quantity="X_WP_by_lengths")
            around = Surroundings(things=(thing,))
            write_replay(path, self.robot, shown, around=around, title=title)

        return {PAGE: write}


@verb()
def replay_log(
    log: InputFile, /, *, robot: RobotWord, fit_frame: Switch = False,
    drive: Annotated[bool, Parameter(name="--follow", negative=())] = False,
    log_format: LogFormat = AUTO, unit: Units = None, mapping: MappingFile = None,
    rate: Rate = None, body: str | None = None, topic: Topics = None, axes: Axes = None,
    out: OutFolder = None, overwrite: Switch = False, formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Replay:  # fmt: skip
    """Replays a log of a machine beside a model of it, with residuals by cable.

    Writes replay.html with the measured run and the model's platform, residuals, replay.csv and
    summary.json. Compares lengths at the measured poses, poses from the measured lengths or the
    motors' angles, and tensions with those that carry the weight. With --follow the simulated robot
    follows the log's lengths; its distance from the measured poses is the error between simulation
    and machine.

    Args:
        log: Log, as import-log writes or reads it.
        robot: Robot of the log.
        fit_frame: Fit the tracker's frame to the positions that the model has for the measured
            lengths; without, the tracker measures in W.
        drive: Also drive the simulated robot with the log's cable lengths.
        log_format: Reader; auto says which and why.
        unit: Units that the file does not state, as length=mm,force=N.
        mapping: YAML file of what columns are: columns: [time_s, C1_length_mm, ''], or name:
            header; skip_rows, separator, rate_hz.
        rate: Rows per second, for files without times [1/s].
        body: Rigid body of a tracker that is the platform.
        topic: Topics of a bag of ROS that are read, as /tracker/pose,/winches; default: all.
        axes: Axes of a tracker's file that are x,y,z of W, as z,x,y or -z,-x,y.
        out: Results folder; default: a new one below runs/; in Python nothing is kept.
        overwrite: Replace results in the folder.
        formats: Files of each figure: png, pdf, svg, or several, as png,pdf.
        follow: Who follows the work.

    Raises:
        LogFileError: The log is not accepted, or has neither poses with lengths or tensions, nor
            lengths that determine a pose.
        CdprError: The robot or an argument is not accepted.
        OutputFolderError: The folder holds other results or files, or cannot be written.
    """
    loaded = as_robot(robot, "replay_log")
    facts = facts_of(unit=unit, mapping=mapping, rate=rate, body=body, axes=axes, topic=topic)
    facts = replace(facts, robot_cables=tuple(cable.name for cable in loaded.cables))
    recorded = read_log(log, facts, log_format)
    recorded = recorded.with_remarks(*unused_facts(recorded, facts))
    arguments = {
        "log": str(log), "robot": loaded.name, "fit_frame": fit_frame, "follow": drive,
        "log_format": log_format, "unit": dict(unit or {}), "rate_hz": rate, "body": body,
        "topics": None if topic is None else list(topic),
        "mapping": None if mapping is None else str(mapping),
        "axes": None if facts.R_WF is None else facts.R_WF.tolist(),
    }  # fmt: skip
    name = f"replay-{Path(log).stem}"
    results = follow.results
    with results_folder(f"runs/{name}", arguments, out, overwrite, results) as folder:
        follow.doing("Comparing the log with the model")
        replay = compare_log(loaded, recorded, fit_frame)
        if drive:
            follow.doing("Following the log's lengths")
            replay = replace(replay, followed=_follow(replay))
        if folder is not None:
            replay = replace(replay, folder=folder.path)
            write_result(replay, folder, formats, follow, replay.pages())
    return replay


def compare_log(robot: Robot, log: Log, fit_frame: bool = False) -> Replay:
    """Puts a model's lengths, poses and tensions beside those of a log, with arguments and errors
    of `replay_log`."""
    measured = bind_log(log, [cable.name for cable in robot.cables])
    m, k, motion, cables = len(robot.cables), measured.count, robot.motion_type(), robot.cable_set()
    nothing = np.full((k, m), np.nan)
    wound = measured.wound(robot)
    lengths = nothing if wound is None else wound
    tensions = nothing if measured.tensions is None else measured.tensions
    poses, home = np.full((k, 7), np.nan), pose_row(robot.home.transform())
    positions = measured.positions(robot)
    if positions is not None:  # where it is, not how it is turned
        poses[:, 4:] = positions
        poses[~np.isfinite(positions).all(axis=1)] = np.nan
        if motion.is_point:
            poses[np.isfinite(poses[:, 4]), :4] = home[:4]
    for number, X in enumerate(measured.poses or []):
        if X is not None:
            poses[number] = pose_row(X)
    by_lengths = _poses_by_lengths(robot, lengths)
    has_place, has_pose = np.isfinite(poses[:, 4]), np.isfinite(poses).all(axis=1)
    has_model = np.isfinite(by_lengths[:, 4])
    if not has_pose.any() and not has_model.any():
        raise LogFileError(
            f"{log.path}: found {', '.join(list(log.frame)[:6])}; accepted for {robot.name}: "
            "poses, or lengths of as many cables as degrees of freedom, as "
            f"{robot.cables[0].name}_{LENGTH}"
        )
    frame = _fitted_frame(log, poses, by_lengths, has_place & has_model) if fit_frame else None
    if frame is not None:
        for row in np.flatnonzero(has_place):
            whole = poses[row] if has_pose[row] else np.r_[home[:4], poses[row, 4:]]
            moved = pose_row(frame @ pose_from_row(whole))
            first = 0 if has_pose[row] and not motion.is_point else 4
            poses[row, first:] = moved[first:]
    predicted, held = nothing.copy(), nothing.copy()
    unbalanced = np.full((k, motion.freedom), np.nan)
    com, gravity = robot.center_of_mass(), robot.gravity_vector()
    at = np.where(has_pose[:, None], poses, by_lengths)
    for row in np.flatnonzero(has_pose | has_model):
        X, t = pose_from_row(at[row]), tensions[row]
        paths, R = cable_paths(X, cables), X.rotation().matrix()
        if has_pose[row]:
            stretched = unstrained_lengths(paths.lengths, np.nan_to_num(t), cables.stiffness)
            predicted[row] = np.where(np.isfinite(t), stretched, paths.lengths)
        W = -motion.columns(paths.J, R).T
        weight = motion.components(gravity_wrench(X, robot.platform.mass, com, gravity), R)
        if np.isfinite(t).all():
            unbalanced[row] = W @ t + weight
            if m <= motion.freedom:
                held[row] = np.linalg.lstsq(W, -weight, rcond=None)[0]
    time = np.arange(1.0, k + 1.0) if log.time is None else log.time
    return Replay(
        robot=robot, log=log, time=time, poses=poses, poses_by_lengths=by_lengths, lengths=lengths,
        predicted_lengths=predicted, tensions=tensions, predicted_tensions=held,
        unbalanced=unbalanced, frame=frame, remarks=measured.remarks,
    )  # fmt: skip


def _poses_by_lengths(robot: Robot, lengths: Array) -> Array:
    """Each from the one before, the first from home, shape (k, 7); NaN if lengths have none."""
    poses, guess = np.full((len(lengths), 7), np.nan), pose_row(robot.home.transform())
    if lengths.shape[1] < robot.motion_type().freedom:
        return poses
    solver = ForwardKinematics(robot.cable_set(), robot.motion_type())
    for row in np.flatnonzero(np.isfinite(lengths).all(axis=1) & np.all(lengths > 0.0, axis=1)):
        fit = solver.poses(lengths[row : row + 1], guess[None], tolerance=TOLERANCE, threads=1)
        if np.isfinite(fit.poses[0]).all():
            poses[row] = guess = fit.poses[0]
    return poses


def _fitted_frame(log: Log, poses: Array, by_lengths: Array, rows: np.ndarray) -> RigidTransform:
    """X_WF in which measured positions are nearest to those by lengths (Kabsch 1976)."""
    if np.count_nonzero(rows) < LEAST_ROWS:
        words = f"{np.count_nonzero(rows)} rows with a pose and lengths"
        raise refusal(log.path, words, f"at least {LEAST_ROWS}, to fit the tracker's frame")
    p_F, p_W = poses[rows, 4:], by_lengths[rows, 4:]
    middle_F, middle_W = p_F.mean(axis=0), p_W.mean(axis=0)
    U, s, Vt = np.linalg.svd((p_F - middle_F).T @ (p_W - middle_W))
    if s[1] < 1e-6 * s[0]:
        raise refusal(log.path, "positions along a line", "some off a line")
    R = Vt.T @ np.diag([1.0, 1.0, np.sign(np.linalg.det(Vt.T @ U.T))]) @ U.T
    return RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), middle_W - R @ middle_F)


def _follow(replay: Replay) -> Followed:
    """The simulated robot, driven with the log's lengths as by winches that follow at once.

    It starts at rest at the first measured pose, else at the model's for the first lengths; from
    there on its cables change as those of the log do, so that offsets of lengths do not matter.
    """
    robot, lengths, path = replay.robot, replay.lengths, replay.log.path
    rows = np.flatnonzero(np.isfinite(lengths).all(axis=1))
    if replay.log.time is None or len(rows) < 2:
        words = f"{len(rows)} rows with all lengths, and {'no ' * (replay.log.time is None)}times"
        raise refusal(path, words, "at least two, with times")
    whole = np.all(np.isfinite(replay.poses), axis=1, keepdims=True)
    at = np.where(whole, replay.poses, replay.poses_by_lengths)
    starts = rows[np.isfinite(at[rows]).all(axis=1)]
    if not len(starts):
        raise refusal(path, "no pose to start at", "at least one")
    rows = rows[rows >= starts[0]]
    time = replay.time[rows] - replay.time[rows[0]]
    block = CompiledCableRobot(robot, rule=StepRule(), command_period=HELD)
    simulator = Simulator(block)
    context, start = simulator.get_mutable_context(), pose_from_row(at[rows[0]])
    if not robot.motion_type().is_free:
        start = robot.joint().nearest(start)
    block.set_at_equilibrium(context, start)
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(lengths.shape[1]))
    rates = np.diff(lengths[rows], axis=0) / np.diff(time)[:, None]
    poses, tensions = np.empty((len(rows), 7)), np.empty((len(rows), lengths.shape[1]))
    for k, t in enumerate(time):
        simulator.AdvanceTo(t)
        poses[k] = pose_row(block.GetOutputPort("X_WP").Eval(context))
        tensions[k] = block.GetOutputPort("tensions").Eval(context)
        if k < len(rates):
            block.GetInputPort("cable_velocities").FixValue(context, rates[k])
    return Followed(rows, poses, tensions)


def _mean(values: Array) -> float | None:
    return float(np.mean(values[np.isfinite(values)])) if np.isfinite(values).any() else None


def _rms(values: Array) -> float | None:
    square = _mean(values**2)
    return None if square is None else float(np.sqrt(square))


def _most(values: Array) -> float | None:
    return float(np.nanmax(np.abs(values))) if np.isfinite(values).any() else None
