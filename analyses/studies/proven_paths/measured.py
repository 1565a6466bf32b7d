"""What is measured of a problem: its proven motion, other planners, a free motion."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdpr_drake.analyses.planning.free_motion import FreeSettings, solve_free_motion
from cdpr_drake.analyses.planning.robot_path_task import length_scale
from cdpr_drake.analyses.studies.proven_paths.problems import (
    Scene,
    Spec,
    proven_sets,
    scene_of,
    sets_of,
)
from cdpr_drake.analyses.studies.proven_paths.sampled_planners import (
    Space,
    along,
    length_of,
    ompl_path,
    rrt_star,
    shortcut,
)
from cdpr_drake.analyses.workspaces.proven_sets import ProvenSets
from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.planning.path_in_sets import ProvenMotion, proven_motion
from cdpr_drake.workspaces.proven_connection import inside_cell, separated

FOUND, PARTED, OPEN, BORDER = (
    "found", "proven: none exists", "sets not connected (open cells remain: unproven)",
    "an end is not proven",
)  # fmt: skip
"""What is said of a problem: a path; poses that are proven outside part its ends; neither; or an
end lies in a cell that could not be proven."""

FREE_FOUND = "found"
"""What is said of a free motion that was found; else its refusal."""


@dataclass(frozen=True)
class Effort:
    """How much is done for a problem.

    Attributes:
        boxes: Boxes that are judged for the sets of a scene.
        cells: Cells of their raster, at most.
        more_boxes: The same for one problem whose ends these do not connect; 0: not again.
        more_cells: Likewise.
        samples: Of a proven path or a free motion, that the exact checks judge.
        vertices: Samples of RRT*.
        looks: Samples of its paths, that the exact checks judge.
    """

    boxes: int
    cells: int
    more_boxes: int
    more_cells: int
    samples: int
    vertices: int
    looks: int


def measure_problem(spec: Spec, effort: Effort) -> dict[str, Any]:
    """Of the proven motion of a problem; NaN and empty where there is nothing to tell."""
    scene = scene_of(spec.robot, spec.scene)
    start, goal = ends = scene.ends[spec.number - 1]
    sets, took = sets_of(spec.robot, spec.scene, effort.boxes, effort.cells)
    status, again = _status(sets, ends), np.nan
    if status != FOUND and effort.more_boxes:
        sets, again = proven_sets(scene, ends, effort.more_boxes, effort.more_cells)
        status = _status(sets, ends)
    assert sets.cells is not None
    row: dict[str, Any] = {
        "status": status, "straight_m": float(np.linalg.norm(goal - start)), "sets": len(sets),
        "cut": sets.cut, "inside_percent": 100.0 * sets.cells.share,
        "outside_percent": 100.0 * float(np.mean(sets.cells.excluded)), "sets_s": took,
        "again_s": again, "ends_m": np.array([start[:3], goal[:3]]),
        "boxes_m": scene.boxes[:, 9:],
    }  # fmt: skip
    return row | _proven(scene, sets, ends, effort.samples if status == FOUND else 0)


def _status(sets: ProvenSets, ends: tuple[Array, Array]) -> str:
    assert sets.cells is not None
    if separated(sets.cells, *ends):
        return PARTED
    if any(inside_cell(sets.cells, end) is None or not sets.covers(end) for end in ends):
        return BORDER
    return FOUND if sets.joined(*ends) else OPEN


def _proven(
    scene: Scene, sets: ProvenSets, ends: tuple[Array, Array], samples: int
) -> dict[str, Any]:
    """Of the proven motion; without samples there is none."""
    numbers = ("length_m", "curve_m", "bound_m", "duration_s", "path_s", "judge_s")
    row: dict[str, Any] = dict.fromkeys(numbers, np.nan)
    row |= {"infeasible": 0, "samples": samples, "path_m": np.empty((0, 3))}
    if not samples:
        return row
    begin = time.process_time()
    found = proven_motion(sets, *ends, scene.task, length_scale(scene.robot))
    took = time.process_time() - begin
    return row | {
        "length_m": found.path.length, "curve_m": found.path.curve.polygon,
        "bound_m": found.path.lower_bound, "duration_s": found.plan.duration, "path_s": took,
        **_judged(scene, _points(found, samples)),
        "path_m": _points(found, SHOWN),
    }  # fmt: skip


SHOWN = 200
"""Points of a path that figures draw."""


def _points(found: ProvenMotion, count: int) -> Array:
    path = found.path.path
    return path.points(np.linspace(0.0, path.length, count))[:, 4:7]


def _judged(scene: Scene, positions: Array) -> dict[str, Any]:
    begin = time.process_time()
    return {"infeasible": scene.wrong(positions), "judge_s": time.process_time() - begin}


def measure_sampled(spec: Spec, effort: Effort) -> dict[str, Any]:
    """Of RRT* and shortcuts: our own, and OMPL's where it is installed."""
    scene = scene_of(spec.robot, spec.scene)
    ends = scene.ends[spec.number - 1]
    low, high = scene.robot.reach()
    space = Space(low, high, scene.good)
    start, goal = ends[0][:3], ends[1][:3]
    begin = time.process_time()
    corners = rrt_star(space, start, goal, effort.vertices, seed=0)
    if corners is not None:
        corners = shortcut(space, corners, seed=0)
    row = _corners_row(OWN_COLUMNS, scene, corners, effort.looks, time.process_time() - begin)
    row |= {
        "looks": effort.looks,
        "rrt_path_m": np.empty((0, 3)) if corners is None else corners,
    }
    begin = time.process_time()
    try:
        other = ompl_path(space, start, goal)
        took = time.process_time() - begin
    except ImportError:
        other, took = None, np.nan
    return row | _corners_row(OMPL_COLUMNS, scene, other, effort.looks, took)


OWN_COLUMNS = ("rrt_m", "rrt_infeasible", "rrt_s")
OMPL_COLUMNS = ("ompl_m", "ompl_infeasible", "ompl_s")
"""Length, samples that do not hold, and processor time of a sampled path."""


def _corners_row(
    columns: tuple[str, str, str], scene: Scene, corners: Array | None, looks: int, took: float
) -> dict[str, Any]:
    if corners is None:
        return dict(zip(columns, (np.nan, 0, took), strict=True))
    length = length_of(corners)
    wrong = scene.wrong(along(corners, np.linspace(0.0, length, looks)))
    return dict(zip(columns, (length, wrong, took), strict=True))


def measure_free(spec: Spec, most_seconds: float, samples: int) -> dict[str, Any]:
    """A free motion between the same poses: its time, or its refusal; judged at samples in time.

    It is told to stop between two starts of the solver, once so much processor time is used.
    """
    scene = scene_of(spec.robot, spec.scene)
    start, goal = (pose_from_angles(end[:3], end[3:]) for end in scene.ends[spec.number - 1])
    asked = FreeSettings(start=start, goal=goal, clearance=0.0, obstacles=scene.boxes)
    begin = time.process_time()

    def stop(words: str) -> None:
        used = time.process_time() - begin
        if used > most_seconds:
            raise PlanningError(f"stopped after {used:.0f} s of processor time: {words}")

    row: dict[str, Any] = {
        "status": FREE_FOUND, "duration_s": np.nan, "length_m": np.nan, "infeasible": 0,
        "samples": 0,
    }  # fmt: skip
    try:
        motion = solve_free_motion(scene.robot, scene.task, asked, stop).motion()
    except PlanningError as refusal:
        return row | {"status": str(refusal)[:160], "free_s": time.process_time() - begin}
    took = time.process_time() - begin
    poses = [motion.pose(t) for t in np.linspace(0.0, motion.end_time, samples)]
    positions = np.array([X.translation() for X in poses])
    wrong = scene.wrong(positions, np.array([X.rotation().matrix() for X in poses]))
    return row | {
        "duration_s": motion.end_time, "length_m": length_of(positions), "infeasible": wrong,
        "samples": samples, "free_s": took,
    }  # fmt: skip
