"""Questions of the study: robots, tension limits, kinds and grids over the whole frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cdpr_drake.analyses.workspaces.conditions import KINDS
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
from cdpr_drake.workspaces.volume import VolumeRule, WorkspaceVolume, workspace_volume

PUBLISHED_LOWER = {
    "acrobot_small": (0.0, 1.0),
    "acrobot_large": (0.0, 1.0),
    "caroca": (0.0, 30.0),
}
"""Robots and lower tension limits of figures 1.17 and 1.18 [N]. The upper limit is not printed."""

UPPER_SHARES = (1.0, 0.5, 2.0)
"""Upper limits over that of the robot's file, with which the figures are computed."""

STEPS = {"acrobot_small": 0.025, "acrobot_large": 0.025, "caroca": 0.1}
"""Distance of neighbours in the figures, full form, about [m]."""

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

FIGURE, EVERY, ALONE, ZERO, HEAVY, ENDLESS = (
    "figure", "every kind", "alone", "zero sets", "other mass", "no upper limit",
)  # fmt: skip
"""What items are for."""


@dataclass(frozen=True, eq=False)
class WorkspaceItem:
    """A question of the study, a task of its sweep.

    Attributes:
        name: Unique in the study.
        group: `FIGURE`, `EVERY`, `ALONE`, `ZERO`, `HEAVY` or `ENDLESS`.
        question: The question.
        upper_share: Upper tension limit over that of the robot's file.
    """

    name: str
    group: str
    question: WorkspaceQuestion
    upper_share: float = 1.0

    @property
    def robot(self) -> str:
        """Name of the robot."""
        return self.question.robot

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest tension [N]."""
        case = self.question.about.case
        return float(case.lower[0]), float(case.upper[0])


@dataclass(frozen=True, eq=False)
class FoundWorkspace:
    """An item with its answers.

    Attributes:
        item: The item.
        holds: Where each kind holds, over all poses of the grid, shape (n,).
    """

    item: WorkspaceItem
    holds: dict[str, np.ndarray]

    @property
    def all_kinds(self) -> np.ndarray:
        """Where all its kinds hold, shape (n,)."""
        return np.asarray(np.logical_and.reduce(list(self.holds.values())))

    def places(self, holds: np.ndarray) -> np.ndarray:
        """A kind on the axes of the grid, shape (nx, ny, nz)."""
        return np.asarray(holds).reshape(self.item.question.grid.shape[1:])

    def volume(self, holds: np.ndarray) -> WorkspaceVolume:
        """Volume of the cells with all corners inside, of the frame; an area in a plane."""
        axes = self.item.question.grid.axes
        return workspace_volume(self.places(holds), axes, VolumeRule.CORNERS)


@dataclass(frozen=True)
class LeftOut:
    """A kind that a robot cannot be asked for."""

    robot: str
    kind: str
    why: str


def frame_grid(robot: Robot, counts: Sequence[int]) -> WorkspaceGrid:
    """Points over the robot's frame, the platform unturned; of a planar robot in its plane."""
    lower, upper = robot.reach()
    return grid_by_count(lower, upper, counts)


def figure_items(quick: bool) -> list[WorkspaceItem]:
    """Static workspaces of figures 1.17 and 1.18, with the upper limit of the file and others."""
    items = []
    for name, lowers in PUBLISHED_LOWER.items():
        robot = load_robot(name)
        step = STEPS[name] * (QUICK_STEPS if quick else 1.0)
        counts = [round(float(n)) + 1 for n in (robot.frame.upper - robot.frame.lower) / step]
        grid = frame_grid(robot, counts)
        file_upper = robot.tension_limits(None)[1]
        for lower in lowers:
            for share in UPPER_SHARES:
                limits = (lower, share * file_upper)
                question = make_workspace_question(
                    name, ["static"], grid, asked=WorkspaceRequest(limits=limits)
                )
                words = f"{name}, {limits[0]:g} to {limits[1]:g} N"
                items.append(WorkspaceItem(words, FIGURE, question, share))
    return items


ROBOTS = (
    "acrobot_fully_constrained", "acrobot_large", "acrobot_small", "caroca", "caroca_gazebo",
    "planar",
)  # fmt: skip
"""Robots of the two theses, of which every kind is looked at."""


def kind_items(quick: bool) -> tuple[list[WorkspaceItem], list[LeftOut]]:
    """Every kind for every robot of `ROBOTS`, what checks it, and kinds that are not possible."""
    items: list[WorkspaceItem] = []
    left_out: list[LeftOut] = []
    for name in ROBOTS:
        mine, without = _robot_items(name, QUICK_POINTS if quick else KIND_POINTS)
        items += mine
        left_out += without
    return items, left_out


def _robot_items(name: str, counts: Sequence[int]) -> tuple[list[WorkspaceItem], list[LeftOut]]:
    robot = load_robot(name)
    grid = frame_grid(robot, counts)
    asked, problem = _asked_of(robot, name, grid)
    left_out = [] if problem is None else [LeftOut(name, CAMERA_KIND, problem)]
    wanted = [kind for kind in KINDS if kind != CAMERA_KIND or problem is None]
    try:
        every = make_workspace_question(name, wanted, grid, asked=asked)
    except CdprError:
        refused = {kind: _refusal(name, kind, grid, asked) for kind in wanted}
        left_out += [LeftOut(name, kind, why) for kind, why in refused.items() if why]
        wanted = [kind for kind, why in refused.items() if not why]
        every = make_workspace_question(name, wanted, grid, asked=asked)
    kinds = every.kinds
    alone = [
        WorkspaceItem(f"{name}, {kind} alone", ALONE, replace(every, kinds=(kind,)))
        for kind in kinds
    ]
    zero = WorkspaceRequest(required=SpatialSet(), accelerations=SpatialSet())
    low = robot.tension_limits(None)[0]
    checks: list[tuple[str, list[str], WorkspaceRequest]] = [
        (ZERO, ["static", "dynamic", "wrench-feasible"], zero),
        (ENDLESS, ["static"], WorkspaceRequest(limits=(low, STRONG))),
    ]
    if "wrench-closure" in kinds:
        heavy = WorkspaceRequest(mass=OTHER_MASS * robot.platform.mass)
        checks.append((HEAVY, ["wrench-closure"], heavy))
    items = [WorkspaceItem(f"{name}, {EVERY}", EVERY, every), *alone]
    for group, some, given in checks:
        question = make_workspace_question(name, some, grid, asked=given)
        items.append(WorkspaceItem(f"{name}, {group}", group, question))
    return items, left_out


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
    )
