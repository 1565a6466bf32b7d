"""Where a robot can work, and where its visual servo is stable, over a grid of poses."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cdpr_drake.analyses.workspaces.stability_defaults import load_bounds, workspace_defaults
from cdpr_drake.analyses.workspaces.stability_question import (
    StabilityQuestion,
    make_question,
    scenario_task,
)
from cdpr_drake.analyses.workspaces.stability_results import (
    StabilityWorkspaces,
    stability_workspaces,
)
from cdpr_drake.analyses.workspaces.static_feasible import static_case
from cdpr_drake.analyses.workspaces.workspace_files import load_obstacles
from cdpr_drake.analyses.workspaces.workspace_question import (
    WorkspaceQuestion,
    WorkspaceRequest,
    interference_bodies,
    make_workspace_question,
)
from cdpr_drake.analyses.workspaces.workspace_results import RobotWorkspace, robot_workspace
from cdpr_drake.arrays import Array
from cdpr_drake.errors import StabilityError, WorkspaceError, WorkspaceGridError
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.verdict import VerdictOptions
from cdpr_drake.summaries import as_kind
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid, grid_by_count, grid_by_step

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Box = tuple[Array, Array]
"""Lower and upper corner in W, shape (3,) each [m]."""

AROUND = ("obstacles", "exit_free", "anchor_free")
WRENCHES = ("force", "moment")
ASKED = (
    *(field.name for field in fields(WorkspaceRequest) if field.name != "around"),
    *AROUND, *WRENCHES,
)  # fmt: skip
"""What `compute_workspace` can be asked for by name."""

HELD = ("limits", "mass", "wrench")
"""What cables have to hold in `assess_stability`, by name."""


class DrawnWorkspace(RobotWorkspace):
    """A `RobotWorkspace` that draws itself."""

    def plot(self, measure: str | None = None) -> Figure:
        """Planes of the grid, coloured by what holds, or by a measure."""
        from cdpr_drake.analyses.workspaces.workspace_figures import planes_figure

        return planes_figure(self, measure)


class DrawnStability(StabilityWorkspaces):
    """`StabilityWorkspaces` that draw themselves."""

    def plot(self, bounds: str | None = None) -> Figure:
        """Planes of the grid, coloured by what holds under bounds of a name; None: the first."""
        from cdpr_drake.analyses.workspaces.stability_figures import planes_figure

        return planes_figure(self, bounds)


def default_box(
    robot: Robot | str | Path, box: Box | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners and step of a robot's default grid, with as many points in a box in its place.

    An axis along which the platform does not move stays as it is.

    Args:
        robot: The robot, or its name or path.
        box: In the place of the robot's own.

    Returns:
        Lower corner, upper corner and step, shape (3,) each [m].
    """
    defaults = workspace_defaults(as_robot(robot), _name(robot))
    lower, upper, step = defaults.lower, defaults.upper, defaults.step
    if box is None:
        return lower, upper, step
    low, high = (np.asarray(corner, float) for corner in box)
    if low.shape != (3,) or high.shape != (3,) or not np.all(low < high):
        raise WorkspaceGridError("box: accepted: lower below upper corner, shape (3,) each [m]")
    free = lower < upper
    by = np.where(free, step * (high - low) / np.where(free, upper - lower, 1.0), step)
    return np.where(free, low, lower), np.where(free, high, upper), by


def pose_grid(
    robot: Robot | str | Path,
    grid: WorkspaceGrid | Sequence[int] | None = None,
    box: Box | None = None,
) -> WorkspaceGrid:
    """A grid of poses of a robot.

    Args:
        robot: The robot, or its name or path.
        grid: Itself; or numbers of points along x, y, z of a box; None: as the robot's default.
        box: The box; None: the robot's, see `default_box`.

    Raises:
        WorkspaceGridError: It has no points or makes no sense.
    """
    if isinstance(grid, WorkspaceGrid):
        return grid
    lower, upper, step = default_box(robot, box)
    if grid is None:
        return grid_by_step(lower, upper, step)
    counts = list(grid)
    if len(counts) != 3 or not all(isinstance(n, int | np.integer) for n in counts):
        raise WorkspaceGridError(
            f"grid: found {grid!r}; accepted: a WorkspaceGrid, or numbers of points along x, y, z"
        )
    counts = [1 if low == high else n for n, low, high in zip(counts, lower, upper, strict=True)]
    return grid_by_count(lower, upper, counts)


def workspace_question(
    robot: Robot | str | Path,
    kinds: str | Sequence[str] = "static",
    grid: WorkspaceGrid | Sequence[int] | None = None,
    *,
    measures: str | Sequence[str] = (),
    orientations: str = "all",
    box: Box | None = None,
    **asked: Any,
) -> WorkspaceQuestion:
    """What `compute_workspace` computes; arguments as there."""
    for name in asked:
        if name not in ASKED:
            raise WorkspaceError(f"{name!r} is unknown; {closest(name, ASKED)}")
    loaded = as_robot(robot)
    own = {"pulleys": True} | {k: v for k, v in asked.items() if k not in (*AROUND, *WRENCHES)}
    force, moment = (asked.get(name) for name in WRENCHES)
    if force is not None or moment is not None:
        if own.get("required") is not None:
            raise WorkspaceError("required: found force or moment too; accepted: one way")
        own["required"] = wrench_box(force, moment)
    obstacles = asked.get("obstacles")
    if isinstance(obstacles, str | Path):
        obstacles = load_obstacles(Path(obstacles))
    around = interference_bodies(
        loaded, obstacles, asked.get("exit_free"), asked.get("anchor_free"), own["pulleys"]
    )
    return make_workspace_question(
        robot, _words(kinds), pose_grid(robot, grid, box), _words(measures), orientations,
        WorkspaceRequest(around=around, **own),
    )  # fmt: skip


def compute_workspace(
    robot: Robot | str | Path,
    kinds: str | Sequence[str] = "static",
    grid: WorkspaceGrid | Sequence[int] | None = None,
    *,
    measures: str | Sequence[str] = (),
    orientations: str = "all",
    box: Box | None = None,
    folder: Path | str | None = None,
    workers: int | None = 1,
    **asked: Any,
) -> DrawnWorkspace:
    """Where a robot can work: kinds of workspaces, what they have in common, and measures.

    Args:
        robot: The robot, or its name or path.
        kinds: Names of `KINDS` of `analyses.workspaces.conditions`, such as static,
            wrench-feasible, interference-free.
        grid: Poses: a WorkspaceGrid, or numbers of points along x, y, z; None: as the robot's
            default grid.
        measures: Names of `MEASURES` of the same module.
        orientations: Where kinds must hold: in all of the grid's orientations, or in any.
        box: Lower and upper corner in W, shape (3,) each, in the place of the default box [m].
        folder: Where finished work and the result are kept and found; None: nowhere.
        workers: Processes; None: one for each processor.
        asked: What kinds shall be asked for: `limits` (2,) [N], `mass` [kg], `wrench` (6,)
            [N m, N], `force` [N] and `moment` [N m] to resist along and about each axis, or
            `required`, a SpatialSet; `accelerations`, `velocities`, `clearance` [m], `obstacles`,
            rows of boxes or a file; `exit_free`, `anchor_free` [m], `scenario`, `pulleys`,
            `method`, see `WorkspaceRequest` and `interference_bodies`.

    Raises:
        CdprError: Something is unknown, missing, out of range, or not possible for the robot.
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
    """
    question = workspace_question(
        robot, kinds, grid, measures=measures, orientations=orientations, box=box, **asked
    )
    found = robot_workspace(question, _folder(folder), workers).workspace
    assert found is not None  # nobody stopped it
    return as_kind(DrawnWorkspace, found)


def wrench_box(force: float | None, moment: float | None) -> SpatialSet:
    """Wrenches up to a force along each axis [N] and a moment about each [N m]; None: none.

    Raises:
        WorkspaceError: One is negative or not finite.
    """
    for name, value in (("force", force), ("moment", moment)):
        if value is not None and not (math.isfinite(value) and value >= 0.0):
            raise WorkspaceError(f"{name}: found {value:g}; accepted: a finite number >= 0")
    return SpatialSet(box=np.array([*[moment or 0.0] * 3, *[force or 0.0] * 3]))


def stability_question(
    robot: Robot | str | Path,
    scheme: str = "pbvs",
    verdict: str = "searched",
    *,
    bounds: PerturbationBounds | Path | str | None = None,
    vary: Mapping[str, Sequence[float]] | None = None,
    grid: WorkspaceGrid | Sequence[int] | None = None,
    scenario: str | None = None,
    options: VerdictOptions | Mapping[str, Any] | None = None,
    **held: Any,
) -> StabilityQuestion:
    """What `assess_stability` computes; arguments as there."""
    for name in held:
        if name not in HELD:
            raise StabilityError(f"{name!r} is unknown; {closest(name, HELD)}")
    return make_question(
        robot, scheme=scheme, verdict=verdict,
        bounds=load_bounds(Path(bounds)) if isinstance(bounds, str | Path) else bounds,
        vary=vary, grid=pose_grid(robot, grid), options=_options(options),
        statics=static_case(as_robot(robot), **held),
        task=None if scenario is None else scenario_task(robot, scenario),
    )  # fmt: skip


def assess_stability(
    robot: Robot | str | Path,
    scheme: str = "pbvs",
    verdict: str = "searched",
    *,
    bounds: PerturbationBounds | Path | str | None = None,
    vary: Mapping[str, Sequence[float]] | None = None,
    grid: WorkspaceGrid | Sequence[int] | None = None,
    scenario: str | None = None,
    options: VerdictOptions | Mapping[str, Any] | None = None,
    folder: Path | str | None = None,
    workers: int | None = 1,
    **held: Any,
) -> DrawnStability:
    """Where a visual servo is stable in spite of perturbations, and the platform can be held.

    Args:
        robot: The robot, or its name or path.
        scheme: pbvs, pbvs-line, 2.5d or ibvs.
        verdict: sampled, searched or certified.
        bounds: Perturbation bounds, or a file of them; None: those of the servoing thesis.
        vary: Values of single bounds, each with the others as they are [m, rad], in degrees where
            the name ends in _deg.
        grid: Poses, as `compute_workspace` takes them.
        scenario: Whose object, desired view and camera count; None: as in the servoing thesis.
        options: How hard to look: `VerdictOptions`, or some of its fields by name.
        folder: Where finished work and the result are kept and found; None: nowhere.
        workers: Processes; None: one for each processor.
        held: What the cables have to hold: `limits` (2,) [N], `mass` [kg], `wrench` (6,) [N m, N].

    Raises:
        CdprError: Something is unknown, out of range, or not possible for the robot.
        OutputFolderError: The folder belongs to other arguments, or cannot be written.

    Source: servoing thesis 3.3, (3.27), (3.28).
    """
    question = stability_question(
        robot, scheme, verdict, bounds=bounds, vary=vary, grid=grid, scenario=scenario,
        options=options, **held,
    )  # fmt: skip
    found = stability_workspaces(question, _folder(folder), workers).workspaces
    assert found is not None  # nobody stopped it
    return as_kind(DrawnStability, found)


def _name(robot: Robot | str | Path) -> str:
    return robot.name if isinstance(robot, Robot) else str(robot)


def _words(names: str | Sequence[str]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else tuple(names)


def _folder(folder: Path | str | None) -> Path | None:
    return None if folder is None else Path(folder)


def _options(options: VerdictOptions | Mapping[str, Any] | None) -> VerdictOptions:
    if isinstance(options, VerdictOptions):
        return options
    known = [field.name for field in fields(VerdictOptions)]
    for name in options or {}:
        if name not in known:
            raise StabilityError(f"options: {name!r} is unknown; {closest(name, known)}")
    return replace(VerdictOptions(), **(options or {}))
