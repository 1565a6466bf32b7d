"""After a calibration: the poses at which measurements would tell most of what is still unsure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from rich.table import Table

from cdpr_drake.analyses.calibration.calibrated_robots import calibrated_robot
from cdpr_drake.analyses.calibration.calibration_request import Prepared, prepare
from cdpr_drake.analyses.calibration.calibration_task import Calibration
from cdpr_drake.analyses.calibration.candidate_poses import in_short_hops, rest_poses
from cdpr_drake.analyses.calibration.motion_start import off_plane
from cdpr_drake.analyses.reporting.log_files import finite, write_whole
from cdpr_drake.analyses.reporting.tables import new_table
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.measurements import (
    simulated_corners,
    simulated_poses,
    simulated_swivels,
)
from cdpr_drake.calibration.pose_design import choose_poses, expected_std, informing_rows
from cdpr_drake.calibration.program import CalibrationProgram, first_readings
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.geometry.poses import angles_from_rotation

FILE = "next_poses.csv"
"""Of a results folder: a path as `cdpr plan --path` reads it."""

CANDIDATES, FEWEST = 5, 60
"""Poses that are drawn for each that is chosen, and at least."""

FRAMES_KNOWN = 1e-4
"""Information, in typical sizes, put into what nothing tells, so that determinants exist; poses
tell nothing of it either, and it changes no choice."""


@dataclass(frozen=True, eq=False)
class NextPoses:
    """Poses to go to next, and what is expected of them.

    Attributes:
        poses: X_WP, each near the one before [m].
        names: Of the unknown parameters.
        std_now: Standard deviations now, shape (f,), in the parameters' units.
        std_then: Once all of these poses are measured as those of the log were, shape (f,).
    """

    poses: list[RigidTransform]
    names: tuple[str, ...]
    std_now: Array
    std_then: Array

    def as_dict(self) -> dict[str, Any]:
        """For JSON: poses as in the file, and standard deviations then."""
        return {
            "file": FILE,
            "poses": _rows(self.poses).tolist(),
            "std_then": {
                name: finite(float(std))
                for name, std in zip(self.names, self.std_then, strict=True)
            },
        }

    def table(self) -> Table:
        """Standard deviations by kind, now and then."""
        table = new_table(
            f"Next {len(self.poses)} poses, in {FILE}", ("parameters",),
            ("largest std now", "then", "median now", "then"),
        )  # fmt: skip
        kinds = [_kind(name) for name in self.names]
        for kind in dict.fromkeys(kinds):
            mine = np.array([one == kind for one in kinds])
            now, then = self.std_now[mine], self.std_then[mine]
            numbers = (np.max(now), np.max(then), np.median(now), np.median(then))
            table.add_row(kind, *(f"{value:.2g}" for value in numbers))
        return table

    def write(self, folder: Path) -> None:
        """Writes `next_poses.csv`: x, y, z in W [m], phi, theta, psi [deg]."""
        lines = ["x,y,z,phi,theta,psi"]
        lines += [",".join(f"{value:.9g}" for value in row) for row in _rows(self.poses)]
        write_whole(folder / FILE, "\n".join(lines) + "\n")


def next_poses(
    calibration: Calibration, count: int, say: Callable[[str], None] = lambda words: None
) -> NextPoses:
    """The poses of which most is expected after a calibration, D-optimally among candidates.

    Candidates are drawn where the robot that was found can rest. What was measured in the log
    would be measured there, too, as well; a tag that is out of the image tells nothing.

    Args:
        calibration: What was found so far.
        count: Poses to propose.
        say: Told what is done now.

    Raises:
        CalibrationError: The robot that was found can rest at too few poses.
    """
    result = calibration.result
    robot, _ = calibrated_robot(calibration.task.robot, result, calibration.mount)
    say("Looking for poses that would tell most")
    candidates, tensions = rest_poses(
        robot, max(CANDIDATES * count, FEWEST), np.random.default_rng(0)
    )
    prepared = prepare(replace(calibration.task, robot=robot), calibration.log)
    program = _expected(prepared, calibration, candidates, tensions)
    rows = informing_rows(program.least_squares(), program.at())
    known = result.information + FRAMES_KNOWN * np.eye(len(result.names))
    chosen, _ = choose_poses(rows, count, known)
    more = np.einsum("krf,krh->fh", rows[chosen], rows[chosen])
    return NextPoses(
        in_short_hops([candidates[k] for k in chosen], result.stations.poses()[-1]),
        result.names, result.std, expected_std(result.information + more, result.typical),
    )  # fmt: skip


def _expected(
    prepared: Prepared, calibration: Calibration, poses: list[RigidTransform], tensions: Array
) -> CalibrationProgram:
    """A program of what would be measured at poses, without noise."""
    task, log, model = prepared.task, prepared.log, calibration.result.model
    sigmas, random = task.sigmas, np.random.default_rng(0)
    motion = prepared.freedom.motion
    program = CalibrationProgram(model, poses, calibration.result.names, motion=motion)
    if prepared.is_zeroed():
        _expect_zeroed(prepared, program)
    elif prepared.lengths is not None:
        lengths = Point(model, Stations.at(poses)).numbers[:, :, 0]
        sigma = np.hypot(sigmas.lengths, sigmas.lengths_share * lengths)
        program.AddLengths(lengths, sigma, first_readings(prepared.lengths))
    if log.swivels is not None:
        program.AddSwivels(simulated_swivels(model, poses, 0.0, random), sigmas.swivels)
    if prepared.rest:
        weight, com = (
            task.robot.platform.mass * task.robot.gravity_vector(),
            (task.robot.center_of_mass()),
        )
        program.AddRest(weight, com, sigmas.moments, sigmas.forces, tensions)
        if log.tensions is not None:
            sigma = np.hypot(sigmas.tensions, sigmas.tensions_share * tensions)
            program.AddTensions(tensions, sigma)
    if log.poses is not None:
        told = simulated_poses(poses, 0.0, 0.0, random, model)
        program.AddTrackedPoses(told, sigmas.turn, sigmas.place)
    if prepared.points is not None:
        seen = [X.translation() for X in simulated_poses(poses, 0.0, 0.0, random, model)]
        program.AddTrackedPoints(
            np.array(seen), sigmas.place, normal=off_plane(task.robot), sigma_along=sigmas.off_plane
        )
    if prepared.targets:
        assert prepared.pinhole is not None
        targets = {tag: prepared.targets[tag] for tag in model.tags if tag in prepared.targets}
        uv = simulated_corners(model, poses, targets, prepared.pinhole, 0.0, random)
        points = {tag: target.points for tag, target in targets.items()}
        program.AddTagCorners(points, uv, sigmas.corners, prepared.pinhole)
    return program


def _expect_zeroed(prepared: Prepared, program: CalibrationProgram) -> None:
    """Adds cables that would be counted from zero, without noise."""
    task, robot, at = prepared.task, prepared.task.robot, program.at()
    lengths = at.numbers[:, :, 0]
    sigma = np.hypot(task.sigmas.lengths, task.sigmas.lengths_share * lengths)
    home = np.zeros(lengths.shape[1])
    if task.zero is not None:
        home = Point(program.model, Stations.at([task.zero])).numbers[0, :, 0]
    paid = (lengths - home - program.model.length_offset) / program.model.length_scale
    if prepared.log.lengths is not None or prepared.log.angles is None:
        program.AddZeroedCables(paid, sigma, task.zero)
        return
    advantage = np.array([cable.mechanical_advantage for cable in robot.cables])
    drum = robot.drum()
    program.AddZeroedCables(drum.motor_angles(paid), sigma, task.zero, drum, advantage=advantage)


def _kind(name: str) -> str:
    """What parameters of one table row have in common: C3.exit_point.z is an exit_point."""
    parts = name.split(".")
    middle = parts[1] if len(parts) == 3 else parts[-1] if parts[0][-1].isdigit() else parts[0]
    turn = parts[-1] in ("rx", "ry", "rz")
    return f"{middle}, {'turn [rad]' if turn else 'place [m]'}" if len(parts) > 1 else middle


def _rows(poses: list[RigidTransform]) -> Array:
    """x, y, z [m] and Tait-Bryan angles [deg], shape (k, 6)."""
    return np.array([
        [*X.translation(), *np.degrees(angles_from_rotation(X.rotation()))] for X in poses
    ])  # fmt: skip
