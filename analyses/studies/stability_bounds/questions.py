"""What the study asks: which robots, under which bounds, on which poses, and by which methods."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.reporting.timing import processor_seconds
from cdpr_drake.analyses.studies.framework.runs import Row
from cdpr_drake.analyses.studies.framework.study import Case, Form
from cdpr_drake.analyses.studies.published.stability_recipe import (
    DRAWS,
    recipe_case,
    recipe_grid,
    recipe_options,
)
from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.analyses.workspaces.stability_tasks import GridTask
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.stability.closed_loop_kernel import CONVERGED, ClosedLoops, closed_loops
from cdpr_drake.stability.desired_view import FixedObject
from cdpr_drake.stability.interval_bound import interval_margins
from cdpr_drake.stability.lipschitz_bound import lipschitz_margins
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import (
    VERDICTS,
    judge_all_verdicts,
    judge_stability,
    worst_perturbations,
)
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid, grid_by_count
from cdpr_drake.workspaces.volume import VolumeRule, workspace_volume

ROBOTS = ("planar", "acrobot_small", "acrobot_fully_constrained", "caroca")
"""Those of the servoing thesis' tables A.8, A.10, A.11 and A.12."""

SCALES = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0, 2.0, 4.0)
"""Bounds are the thesis' D_b times these."""

QUICK_SCALES = (1 / 4, 1.0)

THESIS = 1.0
"""The scale of the thesis' own bounds."""

COUNTS, QUICK_COUNTS = (11, 11, 5), (5, 5, 3)
"""Points of the grid of spatial robots along x, y, z."""

PLANAR_COUNTS, QUICK_PLANAR_COUNTS = (17, 17, 1), (9, 9, 1)
"""Of the planar robot: every other one of the thesis' 33 x 33."""

LOOPS, QUICK_LOOPS = 4, 2
"""Loops with drawn errors from each pose, besides that with the worst one."""

LOOP_SEED = 11
"""Of the drawn errors of loops and of a second search; the verdicts draw with others."""

PROOFS = ("certified", "lipschitz", "interval")

METHODS = ("sampled", "searched", "simulated", *PROOFS)
"""By growing weight, and the two simple proofs."""

SHARES, COSTS = "shares", "costs"
"""The two experiments."""

COST_POSES, QUICK_COST_POSES = 120, 20
"""Poses of a grid, evenly taken, on which processor time is measured."""

COST_REPEATS = 3
"""Times are the least of so many: what else a machine does only adds to them."""

CUT_SCALE, CUT_PARTS, CUT_POSES = 1 / 4, 2, 30
"""Where intervals are also cut, each of up to nine axes into so many parts, and on how many poses:
512 boxes for a pose of a spatial robot are more than the certificate's pieces."""


@cache
def servo_case(robot_name: str) -> StabilityCase:
    """The robot of the printed tables on its way to the middle of the grid's box, unturned.

    The object is where the camera shall be, so that p_CO is e_t and the exact interaction matrix is
    the printed one, (1.47), too.
    """
    known = recipe_case(robot_name, "pbvs")
    box = recipe_grid(robot_name)
    middle = RigidTransform((box.lower + box.upper) / 2.0)
    target = FixedObject(middle @ known.X_PC, RigidTransform())
    return replace(known, target=target, lever="object")


@cache
def thesis_bounds(robot_name: str) -> PerturbationBounds:
    """D_b, with one shift for all exit points, and one for all anchor points."""
    found = workspace_defaults(load_robot(robot_name), robot_name).bounds
    return found.varied(exits="common", anchors="common")


def pose_grid(robot_name: str, quick: bool) -> WorkspaceGrid:
    """Poses in the box of the printed tables."""
    box = recipe_grid(robot_name)
    if servo_case(robot_name).planar:
        counts = QUICK_PLANAR_COUNTS if quick else PLANAR_COUNTS
    else:
        counts = QUICK_COUNTS if quick else COUNTS
    return grid_by_count(box.lower, box.upper, counts)


def frame_box(robot_name: str) -> tuple[Array, Array]:
    """Where loops may be: the robot's frame, (lower, upper) [m]."""
    frame = load_robot(robot_name).frame
    return frame.lower, frame.upper


@dataclass(frozen=True, eq=False)
class BoundsTask(GridTask):
    """What every method says of poses.

    Attributes:
        loops: Loops with drawn errors from each pose.
        box: Where loops may be, (lower, upper), shape (3,) each [m].
    """

    loops: int
    box: tuple[Array, Array]

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Of the poses start to stop and their loops, the last of which has the worst error.

        Returns:
            One of each of METHODS, shape (n,) bool; unstable: whether either search found an
            unstable error, shape (n,) bool; arrived, shape (n, k) bool; falls, shape (n, k) [-],
            see `ClosedLoops`; contradicts: whether the error first rises at a pose that is
            certified, of loops from certified poses, shape (n, k) bool.
        """
        poses = self.grid.pose_rows(start, stop)
        verdicts = judge_all_verdicts(self.case, self.bounds, poses, self.options)
        again = replace(self.options, seed=LOOP_SEED, margins=True, draws=DRAWS)
        margin, worst = worst_perturbations(self.case, self.bounds, poses, again)
        found = followed(self, poses, worst[:, None])
        stable = {verdict: verdicts[verdict].stable for verdict in VERDICTS}
        arrived = found.ends == CONVERGED
        return {
            **stable,
            "simulated": np.all(arrived[:, :-1], axis=1),
            "lipschitz": lipschitz_margins(self.case, self.bounds, poses) > 0.0,
            "interval": interval_margins(self.case, self.bounds, poses) > 0.0,
            "unstable": ~stable["searched"] | ~(margin > 0.0),
            "arrived": arrived,
            "falls": found.falls,
            "contradicts": self._contradicts(found, stable["certified"]),
        }

    def _contradicts(self, found: ClosedLoops, certified: np.ndarray) -> np.ndarray:
        asked = found.rises & certified[:, None]
        against = np.zeros_like(asked)
        if np.any(asked):
            rises = found.rise_poses[asked]
            against[asked] = judge_stability(
                self.case, self.bounds, rises, "certified", self.options
            ).stable
        return against


def followed(task: BoundsTask, poses: Array, besides: Array) -> ClosedLoops:
    """Loops from poses with drawn errors, and with others, shape (N, k, 18 + 6 m) [rad, m]."""
    case, bounds = task.case, task.bounds
    drawn = [
        draw_perturbations(pose, bounds, case.m, task.loops, LOOP_SEED, case.planar)
        for pose in poses
    ]
    errors = np.concatenate([np.array(drawn), besides], axis=1)
    return closed_loops(case, bounds, poses, errors, task.box, task.options.threads)


def bounds_task(robot_name: str, scale: float, quick: bool) -> BoundsTask:
    """The task of a robot under D_b times a scale, with one thread."""
    return BoundsTask(
        servo_case(robot_name),
        thesis_bounds(robot_name).scaled(scale),
        pose_grid(robot_name, quick),
        replace(recipe_options(robot_name), threads=1),
        QUICK_LOOPS if quick else LOOPS,
        frame_box(robot_name),
    )


def cases(form: Form) -> Iterator[Case]:
    """Each robot under each bounds; then what each method costs at the thesis' bounds."""
    for robot in ROBOTS:
        for scale in QUICK_SCALES if form.quick else SCALES:
            task = bounds_task(robot, scale, form.quick)
            yield Case(
                name=f"{robot}, D_b times {scale:g}",
                keys={"experiment": SHARES, "robot": robot, "scale": scale},
                task=task,
                items=task.grid.size,
            )
    for robot in ROBOTS:
        yield Case(
            name=f"{robot}, costs",
            keys={"experiment": COSTS, "robot": robot, "scale": THESIS},
            data={"quick": form.quick},
            alone=True,
        )


def reduce(case: Case, arrays: Mapping[str, np.ndarray]) -> Row:
    """Shares of the methods, false claims, and what loops from certified poses do.

    Returns:
        Of each method the share of the box, `_percent`, and its poses, `inside_`, shape (nx, ny,
        nz); of each proof `_false`, poses that it claims though an unstable error is known; of the
        grid full_m2 or full_m3, x_m, y_m, z_m and poses; of certified poses `certified_poses`,
        loops from them, of these arrived, rising_at_start and contradictions; least_fall of the
        loops from certified poses [-], NaN where there is none; worst_percent: share of the box
        from which the loop with the worst error arrives.
    """
    assert isinstance(case.task, BoundsTask)
    grid = case.task.grid
    inside = {name: arrays[name].reshape(grid.shape)[0] for name in METHODS}
    volumes = {name: _volume(mask, grid) for name, mask in inside.items()}
    certified, falls = arrays["certified"], arrays["falls"][arrays["certified"]]
    full = _volume(np.ones(grid.shape[1:], bool), grid)[0]
    worst = arrays["arrived"][:, -1].reshape(grid.shape)[0]
    return {
        **{f"{name}_percent": share for name, (_, share) in volumes.items()},
        "worst_percent": _volume(worst, grid)[1],
        **{f"{name}_false": int(np.sum(arrays[name] & arrays["unstable"])) for name in PROOFS},
        "full_m2" if case.task.case.planar else "full_m3": full,
        "poses": grid.size,
        "certified_poses": int(np.sum(certified)),
        "certified_loops": falls.size,
        "arrived": int(np.sum(arrays["arrived"][certified])),
        "rising_at_start": int(np.sum(falls <= 0.0)),
        "contradictions": int(np.sum(arrays["contradicts"])),
        "least_fall": float(np.min(falls)) if falls.size else float("nan"),
        **{f"inside_{name}": mask for name, mask in inside.items()},
        **dict(zip(("x_m", "y_m", "z_m"), grid.axes, strict=True)),
    }


def _volume(inside: np.ndarray, grid: WorkspaceGrid) -> tuple[float, float]:
    """Volume [m^3 or m^2] and share of the box [%] of the cells with all corners inside."""
    found = workspace_volume(inside, grid.axes, VolumeRule.CORNERS)
    return found.value, 100.0 * found.share


def measure(case: Case, seed: int) -> Row:
    """Processor time of each method for a pose under the thesis' bounds; of loops all four.

    Besides what cut intervals prove: cut_percent, uncut_percent and certified_sample_percent of a
    sample of poses under `CUT_SCALE` times these bounds. `seconds` has the times by method [s], and
    that of cut intervals as cut; under this name they are told from results.
    """
    robot, quick = case.keys["robot"], case.data["quick"]
    task = bounds_task(robot, THESIS, quick)
    poses = _sample(task.grid, QUICK_COST_POSES if quick else COST_POSES)
    seconds = {
        name: _least_seconds(_with(work, task, poses), poses) for name, work in WORKS.items()
    }
    small = bounds_task(robot, CUT_SCALE, quick)
    some = _sample(small.grid, QUICK_COST_POSES // 4 if quick else CUT_POSES)
    cut: list[Array] = []
    cut_s = processor_seconds(
        lambda: cut.append(interval_margins(small.case, small.bounds, some, CUT_PARTS))
    )
    certified = judge_stability(small.case, small.bounds, some, "certified", small.options)
    uncut = interval_margins(small.case, small.bounds, some)
    return {
        "seconds": {**seconds, "cut": cut_s / len(some)},
        "cut_percent": 100.0 * float(np.mean(cut[0] > 0.0)),
        "uncut_percent": 100.0 * float(np.mean(uncut > 0.0)),
        "certified_sample_percent": 100.0 * float(np.mean(certified.stable)),
    }


Work = Callable[[BoundsTask, Array], object]


def _judge(verdict: str) -> Work:
    return lambda task, poses: judge_stability(
        task.case, task.bounds, poses, verdict, task.options
    )  # fmt: skip


def _nothing(task: BoundsTask, poses: Array) -> Array:
    return np.zeros((len(poses), 0, 18 + 6 * task.case.m))


WORKS: dict[str, Work] = {
    **{verdict: _judge(verdict) for verdict in VERDICTS},
    "simulated": lambda task, poses: followed(task, poses, _nothing(task, poses)),
    "lipschitz": lambda task, poses: lipschitz_margins(task.case, task.bounds, poses),
    "interval": lambda task, poses: interval_margins(task.case, task.bounds, poses),
}
"""What each method does with poses."""


def _with(work: Work, task: BoundsTask, poses: Array) -> Callable[[], object]:
    """A call without arguments."""
    return lambda: work(task, poses)


def _least_seconds(call: Callable[[], object], poses: Array) -> float:
    """Processor time for a pose, the least of some calls after one that compiles [s]."""
    call()
    return min(processor_seconds(call) for _ in range(COST_REPEATS)) / len(poses)


def _sample(grid: WorkspaceGrid, count: int) -> Array:
    """Poses of a grid, evenly taken, rows as `pose_row`."""
    which = np.unique(np.linspace(0, grid.size - 1, min(count, grid.size)).round().astype(int))
    return grid.pose_rows()[which]


def parameters(form: Form) -> Mapping[str, Any]:
    """What all rows have in common."""
    return {
        "scales": QUICK_SCALES if form.quick else SCALES,
        "loop_seed": LOOP_SEED,
        "robots": {
            robot: {
                "case": servo_case(robot),
                "bounds": thesis_bounds(robot).as_dict(),
                "options": replace(recipe_options(robot), threads=1),
            }
            for robot in ROBOTS
        },
    }
