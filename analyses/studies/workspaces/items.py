"""Questions of the study: robots, tension limits, kinds and grids over the whole frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from cdpr_drake.analyses.studies.framework.runs import Run
from cdpr_drake.analyses.studies.framework.study import Case, Form
from cdpr_drake.analyses.studies.workspaces.distances import POSES, QUICK_POSES, DistanceTask
from cdpr_drake.analyses.studies.workspaces.distances import ROBOTS as DISTANCE_ROBOTS
from cdpr_drake.analyses.workspaces.conditions import OF_POSES
from cdpr_drake.analyses.workspaces.workspace_question import (
    WorkspaceQuestion,
    WorkspaceRequest,
    make_workspace_question,
)
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid, grid_by_count
from cdpr_drake.workspaces.volume import VolumeRule, workspace_volume

PUBLISHED_LOWER = {
    "acrobot_small": (0.0, 1.0),
    "acrobot_large": (0.0, 1.0),
    "caroca": (0.0, 30.0),
}
"""Robots and lower tension limits of figures 1.17 and 1.18 [N]. The upper limit is not printed."""

UPPER_SHARES = (1.0, 0.5, 2.0)
"""Upper limits over that of the robot's file, with which the figures are computed."""

STEPS = {"acrobot_small": 0.025, "acrobot_large": 0.025, "caroca": 0.05}
"""Distance of neighbours in the figures, full form, about [m]: half of it changes what is left at a
higher lower limit by less than 0.1 % on CAROCA, by about 1 % on ACROBOT, whose answer is 10 % away
from the limit, see `docs/theory/reproduction.md`."""

QUICK_STEPS = 4.0
"""The quick form's distances are so much larger."""

KIND_POINTS, QUICK_POINTS = (13, 13, 9), (5, 5, 4)
"""Points along x, y, z over the frame, for all kinds."""

FORCE_SHARE = 0.1
"""Forces to resist along each axis over the robot's weight; moments are these times the arm of its
anchor points."""

ACCELERATIONS = (1.0, 1.0)
"""To have along [m/s^2] and about [rad/s^2] each axis."""

OTHER_MASS = 3.0
"""Mass of the platform over that of the robot's file, where nothing may depend on it."""

CAMERA_KIND = "target-visible"
"""The kind that needs a scenario: a robot's is `FAMILY_pbvs`, as acrobot_pbvs of acrobot_large."""

STRONG = 1e9
"""Upper tension limit that stands for none [N]."""

FIGURE, EVERY, ALONE, ZERO, HEAVY, ENDLESS, DISTANCES = (
    "figure", "every kind", "alone", "zero sets", "other mass", "no upper limit", "distances",
)  # fmt: skip
"""What cases are for."""


@dataclass(frozen=True)
class QuestionTask:
    """Sweep task: the answers of a question.

    Attributes:
        question: The question.
    """

    question: WorkspaceQuestion

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Where each kind holds of the poses start to stop, shape (n,)."""
        return self.question.task()(start, stop)

    def arguments(self) -> dict[str, Any]:
        """All that the answers depend on, for JSON."""
        return self.question.arguments()


def question_case(
    name: str,
    group: str,
    question: WorkspaceQuestion,
    upper_share: float = 1.0,
    left_out: Mapping[str, str] = MappingProxyType({}),
) -> Case:
    """A question of the study.

    Args:
        name: Unique in the study.
        group: `FIGURE`, `EVERY`, `ALONE`, `ZERO`, `HEAVY` or `ENDLESS`.
        question: The question.
        upper_share: Upper tension limit over that of the robot's file.
        left_out: Kinds that the robot cannot be asked for, with the reason.
    """
    statics = question.about.case
    keys = {
        "group": group, "robot": question.robot, "lower_limit_n": float(statics.lower[0]),
        "upper_limit_n": float(statics.upper[0]), "upper_share": upper_share,
    }  # fmt: skip
    task = QuestionTask(question)
    return Case(name=name, keys=keys, data=dict(left_out), task=task, items=question.grid.size)


def distance_case(robot: str, poses: int) -> Case:
    """A comparison of clearances with Drake's distances."""
    keys = {"group": DISTANCES, "robot": robot}
    return Case(name=f"{robot}, distances", keys=keys, task=DistanceTask(robot), items=poses)


def workspace_row(case: Case, arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """What was found.

    Returns:
        Of distances: poses, how many of them differ, how many were settled by least squares,
        difference_m: the largest. Else points: along each axis; x_m, y_m, z_m: of the grid;
        kinds; holds_KIND: where each holds, shape (nx, ny, nz). Of a figure volume_m3 and
        frame_m3, and shares of the poses and of the frame; points_m3 and half_points_m3: the volume
        by the trapezoidal rule, which converges faster, with all points and with every
        second one along each axis. Of every kind what it was asked for,
        pose_shares, frame_shares and pose_shares_of_pairs, and left_out: kinds with the reason.
    """
    if not isinstance(case.task, QuestionTask):
        return {
            "poses": len(arrays["wrong"]),
            "differ": int(np.count_nonzero(arrays["wrong"])),
            "settled": int(np.count_nonzero(arrays["settled"])),
            "difference_m": np.max(arrays["differences"]),
        }
    question = case.task.question
    shape, axes, group = question.grid.shape[1:], question.grid.axes, case.keys["group"]
    holds = {kind: arrays[kind].astype(bool).reshape(shape) for kind in question.kinds}
    row = {
        "points": list(shape),
        "kinds": list(question.kinds),
        **{f"holds_{kind}": one for kind, one in holds.items()},
        **dict(zip(("x_m", "y_m", "z_m"), axes, strict=True)),
    }
    if group == FIGURE:
        volume = workspace_volume(holds["static"], axes, VolumeRule.CORNERS)
        row |= {
            "pose_share": np.mean(holds["static"]), "volume_m3": volume.value,
            "frame_m3": volume.full, "frame_share": volume.share,
            "points_m3": workspace_volume(holds["static"], axes, VolumeRule.POINTS).value,
            "half_points_m3": _every_second(holds["static"], axes),
        }  # fmt: skip
    elif group == EVERY:
        row |= _kind_row(question, holds) | {"left_out": case.data}
    return row


def _every_second(inside: np.ndarray, axes: tuple[np.ndarray, np.ndarray, np.ndarray]) -> float:
    """Volume by the trapezoidal rule on half as many cells along each axis [m^3]."""
    x, y, z = (axis[::2] for axis in axes)
    return workspace_volume(inside[::2, ::2, ::2], (x, y, z), VolumeRule.POINTS).value


def _kind_row(question: WorkspaceQuestion, holds: Mapping[str, np.ndarray]) -> dict[str, Any]:
    about, axes = question.about, question.grid.axes
    assert about.required is not None
    assert about.motion is not None
    return {
        "required_box_nm_n": about.required.box.tolist(),
        "acceleration_box_rad_s2_m_s2": about.motion.accelerations.box.tolist(),
        "scenario": question.scenario,
        "pose_shares": shares_of(holds),
        "frame_shares": {
            kind: workspace_volume(one, axes, VolumeRule.CORNERS).share
            for kind, one in holds.items()
        },
        "pose_shares_of_pairs": {
            a: {b: float(np.mean(holds[a] & holds[b])) for b in holds} for a in holds
        },
    }


ALL = "all"
"""What all kinds of a robot have in common."""

ALL_BUT_CLOSURE = "all but wrench-closure"
"""The same without the kind that robots hanging on their cables never have."""


def shares_of(holds: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Shares of the poses where each kind holds, where all but one do, and all."""
    others = [one for kind, one in holds.items() if kind != "wrench-closure"]
    return {
        **{kind: float(np.mean(one)) for kind, one in holds.items()},
        ALL_BUT_CLOSURE: float(np.mean(np.logical_and.reduce(others))),
        ALL: float(np.mean(np.logical_and.reduce(list(holds.values())))),
    }


def holds_of(run: Run) -> dict[str, np.ndarray]:
    """Where each kind holds, on the axes of the grid, shape (nx, ny, nz)."""
    return {kind: run[f"holds_{kind}"] for kind in run["kinds"]}


def static(run: Run) -> np.ndarray:
    """Where the static kind holds, shape (nx, ny, nz)."""
    return np.asarray(run["holds_static"])


def frame_grid(robot: Robot, counts: Sequence[int]) -> WorkspaceGrid:
    """Points over the robot's frame, the platform unturned; of a planar robot in its plane."""
    lower, upper = robot.reach()
    return grid_by_count(lower, upper, counts)


def figure_cases(quick: bool) -> Iterator[Case]:
    """Static workspaces of figures 1.17 and 1.18, with the upper limit of the file and others."""
    for name, lowers in PUBLISHED_LOWER.items():
        robot = load_robot(name)
        step = STEPS[name] * (QUICK_STEPS if quick else 1.0)
        cells = (robot.frame.upper - robot.frame.lower) / step
        counts = [2 * round(float(n) / 2.0) + 1 for n in cells]  # odd: every second has both ends
        grid = frame_grid(robot, counts)
        file_upper = robot.tension_limits(None)[1]
        for lower in lowers:
            for share in UPPER_SHARES:
                limits = (lower, share * file_upper)
                question = make_workspace_question(
                    name, ["static"], grid, asked=WorkspaceRequest(limits=limits, pulleys=False)
                )
                words = f"{name}, {limits[0]:g} to {limits[1]:g} N"
                yield question_case(words, FIGURE, question, share)


ROBOTS = (
    "acrobot_fully_constrained", "acrobot_large", "acrobot_small", "caroca", "caroca_gazebo",
    "planar",
)  # fmt: skip
"""Robots of the two theses, of which every kind is looked at."""


def study_cases(form: Form) -> Iterator[Case]:
    """All questions: figures, every kind for every robot of `ROBOTS` with what checks it, and
    distances; in the quick form on coarse grids, but distances, which are of drawn poses."""
    points = QUICK_POINTS if form.quick else KIND_POINTS
    for case in chain(figure_cases(form.quick), *(robot_cases(name, points) for name in ROBOTS)):
        yield replace(case, keys={**case.keys, "grid": form.grid})
    for name in DISTANCE_ROBOTS:
        yield distance_case(name, QUICK_POSES if form.quick else POSES)


def robot_cases(name: str, counts: Sequence[int]) -> Iterator[Case]:
    """Every kind that a robot can be asked for, and what checks it."""
    robot = load_robot(name)
    grid = frame_grid(robot, counts)
    asked, problem = _asked_of(robot, name, grid)
    left_out = {} if problem is None else {CAMERA_KIND: problem}
    wanted = [kind for kind in OF_POSES if kind != CAMERA_KIND or problem is None]
    try:
        every = make_workspace_question(name, wanted, grid, asked=asked)
    except CdprError:
        refused = {kind: _refusal(name, kind, grid, asked) for kind in wanted}
        left_out |= {kind: why for kind, why in refused.items() if why}
        wanted = [kind for kind, why in refused.items() if not why]
        every = make_workspace_question(name, wanted, grid, asked=asked)
    kinds = every.kinds
    yield question_case(f"{name}, {EVERY}", EVERY, every, left_out=left_out)
    for kind in kinds:
        yield question_case(f"{name}, {kind} alone", ALONE, replace(every, kinds=(kind,)))
    zero = WorkspaceRequest(required=SpatialSet(), accelerations=SpatialSet(), pulleys=False)
    low = robot.tension_limits(None)[0]
    checks: list[tuple[str, list[str], WorkspaceRequest]] = [
        (ZERO, ["static", "dynamic", "wrench-feasible"], zero),
        (ENDLESS, ["static"], WorkspaceRequest(limits=(low, STRONG), pulleys=False)),
    ]
    if "wrench-closure" in kinds:
        heavy = WorkspaceRequest(mass=OTHER_MASS * robot.platform.mass, pulleys=False)
        checks.append((HEAVY, ["wrench-closure"], heavy))
    for group, some, given in checks:
        question = make_workspace_question(name, some, grid, asked=given)
        yield question_case(f"{name}, {group}", group, question)


def _refusal(name: str, kind: str, grid: WorkspaceGrid, asked: WorkspaceRequest) -> str:
    """Why a robot cannot be asked for a kind; empty if it can."""
    try:
        make_workspace_question(name, [kind], grid, asked=asked)
    except CdprError as refused:
        return str(refused)
    return ""


def _asked_of(robot: Robot, name: str, grid: WorkspaceGrid) -> tuple[WorkspaceRequest, str | None]:
    """What a robot is asked for, and why it has no camera that sees a target, if it has none."""
    asked = sets_of(robot)
    scenario = f"{name.partition('_')[0]}_pbvs"
    try:
        seen = replace(asked, scenario=scenario)
        make_workspace_question(name, [CAMERA_KIND], grid, asked=seen)
    except CdprError as problem:
        where, colon, words = str(problem).partition(": ")
        return asked, f"{Path(where).name}{colon}{words}"  # no folder of this computer
    return seen, None


def sets_of(robot: Robot) -> WorkspaceRequest:
    """Wrenches to resist and accelerations to have, which the kinds of a robot are asked for."""
    force = FORCE_SHARE * robot.platform.mass * robot.gravity
    arm = float(np.sqrt(np.mean(np.sum(robot.cable_set().p_PB ** 2, axis=0))))
    linear, angular = ACCELERATIONS
    return WorkspaceRequest(
        required=SpatialSet(box=np.repeat([force * arm, force], 3)),
        accelerations=SpatialSet(box=np.repeat([angular, linear], 3)),
        pulleys=False,  # as the theses have their workspaces
    )
