"""What a calibration predicts: rows that were held out, and the poses that would tell most next."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform

from cdpr_drake.analyses.fits.robots import calibrated_robot, in_short_hops, rest_poses
from cdpr_drake.analyses.fits.setup import Setup, prepare
from cdpr_drake.analyses.frame.result import Table
from cdpr_drake.analyses.logs.measurements import Measurements, off_plane
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.measurements import (
    simulated_corners,
    simulated_poses,
    simulated_swivels,
)
from cdpr_drake.calibration.pose_design import choose_poses, expected_std, informing_rows
from cdpr_drake.calibration.pose_search import robust_poses
from cdpr_drake.calibration.program import CalibrationProgram, first_readings
from cdpr_drake.calibration.result import CalibrationResult
from cdpr_drake.calibration.sensor_terms import Course
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.errors import CalibrationError
from cdpr_drake.geometry.poses import angles_from_rotation, pose_error

EACH = "each"
"""In the place of rows: every tracked row once, the calibration repeated without it."""

NEAR = 2
"""Fitted rows before and behind a held-out one at whose poses its search begins."""

NEXT_POSES = "next_poses.csv"
"""File of a results folder: a path as `cdpr plan --path` reads it."""

CANDIDATES, FEWEST = 5, 60
"""Poses that are drawn for each that is chosen, and at least."""

FRAMES_KNOWN = 1e-4
"""Information, in typical sizes, put into what nothing tells, so that determinants exist; poses
tell nothing of it either, and it changes no choice."""


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Rows that were predicted by a fit to others.

    Attributes:
        rows: Numbers of the rows, from 0.
        distances: Distances from where the robot's own measurements put the tracker's marker to
            where the tracker saw it, shape (r,) [m].
        angles: Turns of the tracker's poses against them, shape (r,) [rad]; NaN if it tells none.
        fitted: Numbers of the fitted rows, from 0; none if each row was held out once.
    """

    rows: npt.NDArray[np.intp]
    distances: Array
    angles: Array
    fitted: npt.NDArray[np.intp]

    def as_dict(self) -> dict[str, Any]:
        """For JSON; rows count from 1."""
        return {
            "compared_rows": (self.rows + 1).tolist(),
            "fitted_rows": (self.fitted + 1).tolist(),
            "each_held_out_once": not len(self.fitted),
            "distance_m": self.distances.tolist(),
            "distance_median_m": float(np.median(self.distances)),
            "distance_rms_m": float(np.sqrt(np.mean(self.distances**2))),
            "distance_largest_m": float(np.max(self.distances)),
            "angle_rad": self.angles.tolist() if np.isfinite(self.angles).all() else None,
        }

    def words(self) -> str:
        """In one line."""
        numbers = self.as_dict()
        median, rms, most = (1e3 * numbers[f"distance_{k}_m"] for k in ("median", "rms", "largest"))
        on = f"{len(self.fitted)} others" if len(self.fitted) else "all others, each in turn"
        return (
            f"{len(self.rows)} rows were not fitted but predicted by a fit on {on}: "
            f"{median:.3g} mm off in the median, {rms:.3g} mm rms, {most:.3g} mm at most"
        )


def held_groups(words: str | int, log: Measurements, zeroed: bool) -> list[npt.NDArray[np.intp]]:
    """Rows that are held out, from 0, a group for each fit.

    Args:
        words: A number of tracked rows, spread over the log; rows as 100-160,200, from 1; or
            `EACH`.
        log: The log.
        zeroed: True if cables count from zero at a known pose; else they count from the log's
            first row, which has to be fitted.

    Raises:
        CalibrationError: There are no such rows, the tracker saw nothing there, or too few remain.
    """
    tracked = tracked_rows(log)
    if not zeroed:
        tracked = tracked[tracked > 0]
    if not len(tracked):
        raise CalibrationError(f"hold_out: found no tracked row in {log.path} to compare with")
    text = str(words).strip()
    if text == EACH:
        return [np.array([k]) for k in tracked]
    if re.fullmatch(r"\d+", text) and 0 < int(text) < len(tracked):
        spread = np.linspace(0, len(tracked) - 1, int(text) + 2)[1:-1]
        return [tracked[np.unique(np.round(spread).astype(int))]]
    chosen: set[int] = set()
    for part in text.split(","):
        span = re.fullmatch(r"\s*(\d+)(?:\s*-\s*(\d+))?\s*", part)
        if not span or ("-" not in text and "," not in text):
            raise CalibrationError(
                f"hold_out: found {words!r}; accepted: fewer than the {len(tracked)} tracked rows, "
                f"rows as 100-160,200, or {EACH}"
            )
        chosen |= set(range(int(span[1]) - 1, min(int(span[2] or span[1]), log.count)))
    rows = np.array(sorted(chosen & set(tracked.tolist())), dtype=np.intp)
    if not len(rows) or len(rows) == len(tracked):
        raise CalibrationError(
            f"hold_out: found {len(rows)} of {len(tracked)} tracked rows in {words!r}; accepted: "
            "some of them, not all" + ("" if zeroed else ", and not the first row of the log")
        )
    return [rows]


def tracked_rows(log: Measurements) -> npt.NDArray[np.intp]:
    """Rows in which a tracker saw a pose or a position, from 0."""
    if log.points is not None:
        return np.flatnonzero(np.isfinite(log.points).all(axis=1))
    return np.array([k for k, X in enumerate(log.poses or []) if X is not None], dtype=np.intp)


def predicted(
    setup: Setup, result: CalibrationResult, fitted: npt.NDArray[np.intp],
    rows: npt.NDArray[np.intp],
) -> Array:  # fmt: skip
    """Errors of rows, distance and angle, shape (r, 2) [m, rad], as `HeldOut` has them.

    Args:
        setup: The whole log.
        result: Calibration on other rows.
        fitted: Numbers of these, in the order of the result's poses.
        rows: The rows that are predicted.
    """
    log, model = setup.task.log, result.model
    count, freedom = log.count, setup.freedom
    near = [np.argsort(np.abs(fitted - row), kind="stable")[: 2 * NEAR] for row in rows]
    whole = np.repeat(np.arange(len(rows)), [len(starts) for starts in near])
    program = CalibrationProgram(model, [setup.first] * count, (), motion=freedom.motion)
    tensions = setup.guessed_tensions([setup.first] * count) if setup.task.rests else None
    setup.add_winches(program, tensions)
    here = result.stations.only(np.concatenate(near))
    t = None if tensions is None else tensions[rows[whole]]
    at = Point(model, Stations(here.R, here.p, t), program.layout)
    ends = robust_poses(
        [term.only(rows[whole]) for term in program.terms], at, freedom=freedom,
        outliers=setup.task.outliers,
    )  # fmt: skip
    poses, points = ends.stations.poses(), _tracked_points(setup, result)
    held = []
    for n, row in enumerate(rows.tolist()):
        mine = np.flatnonzero(whole == n)
        marker = poses[int(mine[np.argmin(ends.costs[mine])])] @ model.X_PM
        angle = float("nan")
        if log.poses is not None:
            angle = pose_error(marker, model.X_WK @ log.poses[row])[1]
        held.append((np.linalg.norm(marker.translation() - points[row]), angle))
    return np.array(held)


def _tracked_points(setup: Setup, result: CalibrationResult) -> Array:
    """Positions of the tracker's marker in W, by its frame and clock, shape (k, 3) [m]."""
    log, X_WK = setup.task.log, result.model.X_WK
    points = setup.points
    if points is None:
        nothing = np.full(3, np.nan)
        points = np.array([nothing if X is None else X.translation() for X in log.poses or ()])
    elif result.model.clock != 0.0 and log.time is not None:
        points = Course.of(log.time, points).at(result.model.clock)[0]
    return np.asarray(points @ X_WK.rotation().matrix().T + X_WK.translation())


@dataclass(frozen=True, eq=False)
class NextPoses:
    """Poses to go to next, and what is expected of them.

    Attributes:
        poses: X_WP, each near the one before [m].
        names: Names of the unknown parameters.
        std_now: Standard deviations now, shape (f,), in the parameters' units.
        std_then: Once all of these poses are measured as those of the log were, shape (f,).
    """

    poses: list[RigidTransform]
    names: tuple[str, ...]
    std_now: Array
    std_then: Array

    def rows(self) -> Array:
        """x, y, z [m] and Tait-Bryan angles [deg], shape (k, 6)."""
        return np.array([
            [*X.translation(), *np.degrees(angles_from_rotation(X.rotation()))] for X in self.poses
        ])  # fmt: skip

    def as_dict(self) -> dict[str, Any]:
        """For JSON: poses as in the file, and standard deviations then."""
        stds = zip(self.names, self.std_then, strict=True)
        return {
            "file": NEXT_POSES,
            "poses": self.rows().tolist(),
            "std_then": {name: finite(float(std)) for name, std in stds},
        }

    def table(self) -> Table:
        """Standard deviations by kind, now and then."""
        kinds = [_kind(name) for name in self.names]
        rows = []
        for kind in dict.fromkeys(kinds):
            mine = np.array([other == kind for other in kinds])
            now, then = self.std_now[mine], self.std_then[mine]
            numbers = (np.max(now), np.max(then), np.median(now), np.median(then))
            rows.append((kind, *(f"{value:.2g}" for value in numbers)))
        headings = ("parameters", "largest std now", "then", "median now", "then")
        return Table(f"Next {len(self.poses)} poses, in {NEXT_POSES}", headings, rows)

    def text(self) -> str:
        """Lines of the file: x, y, z in W [m], phi, theta, psi [deg]."""
        lines = ["x,y,z,phi,theta,psi"]
        lines += [",".join(f"{value:.9g}" for value in row) for row in self.rows()]
        return "\n".join(lines) + "\n"


def next_poses(setup: Setup, result: CalibrationResult, count: int) -> NextPoses:
    """The poses of which most is expected after a calibration, D-optimally among candidates.

    Candidates are drawn where the calibrated robot can rest. What was measured in the log would be
    measured there, too, as well; a tag that is out of the image tells nothing.

    Args:
        setup: What was measured.
        result: The calibration.
        count: Number of poses.

    Raises:
        CalibrationError: The calibrated robot can rest at too few poses.
    """
    robot, _ = calibrated_robot(setup.task.robot, result, setup.mount)
    count_drawn, random = max(CANDIDATES * count, FEWEST), np.random.default_rng(0)
    candidates, tensions = rest_poses(robot, count_drawn, random)
    program = _expected(prepare(replace(setup.task, robot=robot)), result, candidates, tensions)
    rows = informing_rows(program.least_squares(), program.at())
    known = result.information + FRAMES_KNOWN * np.eye(len(result.names))
    chosen, _ = choose_poses(rows, count, known)
    more = np.einsum("krf,krh->fh", rows[chosen], rows[chosen])
    return NextPoses(
        in_short_hops([candidates[k] for k in chosen], result.stations.poses()[-1]),
        result.names, result.std, expected_std(result.information + more, result.typical),
    )  # fmt: skip


def _expected(
    setup: Setup, result: CalibrationResult, poses: list[RigidTransform], tensions: Array
) -> CalibrationProgram:
    """A program of what would be measured at poses, without noise."""
    task, log, model = setup.task, setup.task.log, result.model
    robot, sigmas, random = task.robot, task.sigmas, np.random.default_rng(0)
    program = CalibrationProgram(model, poses, result.names, motion=setup.freedom.motion)
    lengths = program.at().numbers[:, :, 0]
    sigma = np.hypot(sigmas.lengths, sigmas.lengths_share * lengths)
    if setup.zeroed:
        home = np.zeros(lengths.shape[1])
        if task.zero is not None:
            home = Point(model, Stations.at([task.zero])).numbers[0, :, 0]
        offset = model.length_offset + model.common_length_offset
        paid = (lengths - home - offset) / (model.length_scale * model.common_length_scale)
        if log.lengths is not None or log.angles is None:
            program.AddZeroedCables(paid, sigma, task.zero)
        else:
            advantage = np.array([cable.mechanical_advantage for cable in robot.cables])
            drum = robot.drum()
            angles = drum.motor_angles(paid)
            program.AddZeroedCables(angles, sigma, task.zero, drum, advantage=advantage)
    elif setup.lengths is not None:
        program.AddLengths(lengths, sigma, first_readings(setup.lengths))
    if log.swivels is not None:
        program.AddSwivels(simulated_swivels(model, poses, 0.0, random), sigmas.swivels)
    if setup.task.rests:
        weight, com = robot.platform.mass * robot.gravity_vector(), robot.center_of_mass()
        program.AddRest(weight, com, sigmas.moments, sigmas.forces, tensions)
        if log.tensions is not None:
            sigma = np.hypot(sigmas.tensions, sigmas.tensions_share * tensions)
            program.AddTensions(tensions, sigma)
    seen = simulated_poses(poses, 0.0, 0.0, random, model)
    if log.poses is not None:
        program.AddTrackedPoses(seen, sigmas.turn, sigmas.place)
    if setup.points is not None:
        program.AddTrackedPoints(
            np.array([X.translation() for X in seen]), sigmas.place,
            normal=off_plane(robot), sigma_along=sigmas.off_plane,
        )  # fmt: skip
    if setup.targets:
        assert setup.pinhole is not None
        targets = {tag: setup.targets[tag] for tag in model.tags if tag in setup.targets}
        uv = simulated_corners(model, poses, targets, setup.pinhole, 0.0, random)
        points = {tag: target.points for tag, target in targets.items()}
        program.AddTagCorners(points, uv, sigmas.corners, setup.pinhole)
    return program


def _kind(name: str) -> str:
    """What parameters of one table row have in common: C3.exit_point.z is an exit_point."""
    parts = name.split(".")
    middle = parts[1] if len(parts) == 3 else parts[-1] if parts[0][-1].isdigit() else parts[0]
    turn = parts[-1] in ("rx", "ry", "rz")
    return f"{middle}, {'turn [rad]' if turn else 'place [m]'}" if len(parts) > 1 else middle
