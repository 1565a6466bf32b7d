"""Where a robot can work: over a grid of poses, by a hull, and by boxes that are proven."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.front.session import Say, Session, asked_workers, kept_folder
from cdpr_drake.analyses.reporting.deferred_figures import write_pictures
from cdpr_drake.analyses.reporting.left_folders import RESULTS
from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.analyses.reporting.written_files import whole_file
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.analyses.workspaces.box_certificates import (
    BoxSearch,
    RefinedBoxes,
    agreement_numbers,
    agreements,
    box_numbers,
    box_search,
    certified_boxes,
    refined_boxes,
    save_boxes,
    write_boxes,
)
from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.analyses.workspaces.workspace_files import load_obstacles, load_wrench_set
from cdpr_drake.analyses.workspaces.workspace_hulls import (
    HullBound,
    hull_bound,
    hull_numbers,
    question_hull,
    save_hull,
)
from cdpr_drake.analyses.workspaces.workspace_question import (
    WorkspaceQuestion,
    WorkspaceRequest,
    interference_bodies,
    make_workspace_question,
)
from cdpr_drake.analyses.workspaces.workspace_results import RobotWorkspace, robot_workspace
from cdpr_drake.arrays import Array
from cdpr_drake.errors import StoppedError, WorkspaceError, WorkspaceGridError
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.summaries import as_kind
from cdpr_drake.workspaces.box_grid_agreement import BoxAgreement
from cdpr_drake.workspaces.certified_boxes import CertifiedBoxes
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.hull import WorkspaceHull
from cdpr_drake.workspaces.mesh_files import GRID_ENDINGS, MESH_ENDINGS, mesh_ending, write_hull
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid, grid_by_count, grid_by_step

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Box = tuple[Array, Array]
"""Lower and upper corner in W, shape (3,) each [m]."""

AROUND = ("obstacles", "exit_free", "anchor_free")
WRENCHES = ("force", "moment")
ASKED = (
    *(one.name for one in fields(WorkspaceRequest) if one.name != "around"),
    *AROUND, *WRENCHES,
)  # fmt: skip
"""What `compute_workspace` can be asked for by name."""


@dataclass(frozen=True)
class ShapeRequest:
    """What else is found of a workspace than the poses of its grid.

    Attributes:
        hull: Centre from which rays see its hull, shape (3,) [m]; None: no hull is asked for.
        unbounded: Whether nothing bounds the hull; else it is `box` of `compute_workspace`, or the
            robot's frame, unless that was assumed when the robot was imported.
        rays: Largest number of rays of the hull.
        tolerance: How near to the border of the workspace they end [m].
        mesh: File for the hull's triangles, of an ending in `MESH_ENDINGS`; None: none.
        certify: Whether boxes of `box`, or of the robot's frame, are proven inside or outside: of
            all the kinds that are asked for.
        boxes: Largest number of boxes to judge.
        exit_error: Proven for exit points off by up to so much [m].
        anchor_error: The same of anchor points [m].
        boxes_mesh: File for the boxes as cells of VTK, of an ending in `GRID_ENDINGS`; None: none.
        refine: Corners of a way of Po, shape (n, 3), about which open boxes are cut further at all
            orientations [m]; None: nowhere.
        refine_reach: How far Po may be off the way along each axis [m].
        refine_boxes: Boxes that are judged for it, at most.
    """

    hull: Array | Sequence[float] | None = None
    unbounded: bool = False
    rays: int = 10_000
    tolerance: float = 1e-3
    mesh: Path | str | None = None
    certify: bool = False
    boxes: int = 200_000
    exit_error: float = 0.0
    anchor_error: float = 0.0
    boxes_mesh: Path | str | None = None
    refine: Array | Sequence[Sequence[float]] | None = None
    refine_reach: float = 0.05
    refine_boxes: int = 100_000

    def check(self, box: Box | None) -> None:
        """Refuses what does not go together, before anything is computed.

        Raises:
            WorkspaceError: Names it.
        """
        for name, file, needed, there, endings in (
            ("mesh", self.mesh, "hull", self.hull is not None, MESH_ENDINGS),
            ("boxes_mesh", self.boxes_mesh, "certify", self.certify, GRID_ENDINGS),
        ):
            if file is not None and not there:
                raise WorkspaceError(f"{name}: needs {needed}; accepted: both")
            if file is not None:
                mesh_ending(Path(file), endings)
        if self.unbounded and (self.hull is None or box is not None):
            wrong = "needs hull" if self.hull is None else "found box"
            raise WorkspaceError(f"unbounded: {wrong}; accepted: with hull and without box")
        if self.hull is not None and np.shape(self.hull) != (3,):
            raise WorkspaceError(f"hull: found {self.hull!r}; accepted: x, y, z [m]")
        if self.certify and self.boxes < 1:
            raise WorkspaceError(f"boxes: found {self.boxes}; accepted: at least 1")
        if self.refine is None:
            return
        if not self.certify:
            raise WorkspaceError("refine: needs certify; accepted: both")
        way = np.asarray(self.refine, float)
        if way.ndim != 2 or way.shape[1] != 3 or not len(way) or not np.all(np.isfinite(way)):
            raise WorkspaceError(
                f"refine: found shape {way.shape}; accepted: corners x, y, z, at least one [m]"
            )
        if not (np.isfinite(self.refine_reach) and self.refine_reach >= 0.0):
            raise WorkspaceError(
                f"refine_reach: found {self.refine_reach:g} m; accepted: at least 0"
            )
        if self.refine_boxes < 1:
            raise WorkspaceError(f"refine_boxes: found {self.refine_boxes}; accepted: at least 1")


SHAPES = tuple(one.name for one in fields(ShapeRequest))
"""What else `compute_workspace` can be asked for by name."""


@dataclass(frozen=True, eq=False, repr=False)
class DrawnWorkspace(RobotWorkspace):
    """A `RobotWorkspace` that draws and writes itself, with hull and boxes where asked for.

    Attributes:
        robot: The robot.
        hull: Its hull; None: it was not asked for.
        bound: Where the rays of the hull end at the latest.
        boxes: Boxes proven inside or outside; None: they were not asked for.
        search: What was cut into boxes.
        refined: How boxes were cut further along a way; None: that was not asked for.
        agreement: What the boxes say of the grid, and of the ends of the hull's rays.
        folder: Where it was written; None: nowhere.
        failed: Of each picture that could not be written, the file and why.
    """

    robot: Robot
    hull: WorkspaceHull | None = None
    bound: HullBound | None = None
    boxes: CertifiedBoxes | None = None
    search: BoxSearch | None = None
    refined: RefinedBoxes | None = None
    agreement: Mapping[str, BoxAgreement] = field(default_factory=dict)
    folder: Path | None = None
    failed: Mapping[str, str] = field(default_factory=dict)

    @property
    def interrupted(self) -> bool:
        """Whether the search for boxes was stopped before the end."""
        return self.boxes is not None and not self.boxes.finished

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON, as `cdpr workspace --json` prints it."""
        told = super().as_dict()
        if self.hull is not None:
            told["hull"] = hull_numbers(self.hull, self.bound)
        if self.boxes is not None:
            told["certified"] = box_numbers(self.boxes, self.search)
        if self.refined is not None:
            told["refined"] = self.refined.numbers()
        if self.boxes is not None:
            told["agreement"] = agreement_numbers(self.agreement)
        return told

    def plot(self, measure: str | None = None) -> Figure:
        """Planes of the grid, coloured by what holds, or by a measure."""
        from cdpr_drake.analyses.workspaces.workspace_figures import planes_figure

        return planes_figure(self, measure, self.robot)

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself: shares and volumes of the first kinds, of hull and boxes."""
        title, (grid, *rows) = super().summary()
        more = []
        if self.hull is not None:
            words = f"{self.hull.volume:.4g} m^3, {len(self.hull.vertices)} rays"
            more.append(("hull", words))
        if (proven := self.boxes) is not None:
            words = f"{proven.inside:.2%} inside, {proven.outside:.2%} outside, {proven.open:.2%}"
            more.append(("proven", f"{words} open, {len(proven.verdicts)} boxes"))
        return title, [grid, *more, *rows]

    def write(
        self, folder: Path, formats: Sequence[str] = DEFAULT_FORMATS, say: Say | None = None
    ) -> dict[str, str]:
        """Writes arrays, `results.json`, then figures and page, into a folder that exists.

        Args:
            folder: The folder; in the result's own the arrays of the grid are there already.
            formats: Endings of the files of figures.
            say: Told what should be known of the page.

        Returns:
            Of each picture that could not be written, the file and why, in one line.
        """
        from cdpr_drake.analyses.workspaces.workspace_figures import workspace_pictures
        from cdpr_drake.analyses.workspaces.workspace_scene import workspace_page

        if folder != self.folder:
            self.save(folder)
        if self.hull is not None:
            save_hull(self.hull, folder)
        if self.boxes is not None:
            save_boxes(self.boxes, folder)
        write_json(folder / RESULTS, self.as_dict())
        page, note = workspace_page(self, self.robot, self.hull, self.boxes)
        if note and say is not None:
            say(f"note: {note}")
        drawn = workspace_pictures(self, formats, self.boxes, self.robot)
        return write_pictures(folder, drawn | page)


def default_box(
    robot: Robot | str | Path, box: Box | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners and step of a robot's default grid, with as many points in a box in its place.

    An axis along which the platform does not move stays as it is.

    Args:
        robot: The robot, or its name or path.
        box: Instead of the robot's own.

    Returns:
        Lower corner, upper corner and step, shape (3,) each [m].
    """
    defaults = workspace_defaults(as_robot(robot, "compute_workspace"), _name(robot))
    lower, upper, step = defaults.lower, defaults.upper, defaults.step
    if box is None:
        return lower, upper, step
    low, high = _corners(box)
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
            raise WorkspaceError(f"{name!r} is unknown; {closest(name, (*ASKED, *SHAPES))}")
    loaded = as_robot(robot, "compute_workspace")
    own = {"pulleys": True} | {k: v for k, v in asked.items() if k not in (*AROUND, *WRENCHES)}
    force, moment = (asked.get(name) for name in WRENCHES)
    required = own.get("required")
    if force is not None or moment is not None:
        if required is not None:
            raise WorkspaceError("required: found force or moment too; accepted: one way")
        own["required"] = wrench_box(force, moment)
    elif isinstance(required, str | Path):
        own["required"] = load_wrench_set(Path(required))
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


@verb()
def compute_workspace(
    robot: Robot | str | Path,
    kinds: str | Sequence[str] = "static",
    grid: WorkspaceGrid | Sequence[int] | None = None,
    *,
    measures: str | Sequence[str] = (),
    orientations: str = "all",
    box: Box | None = None,
    folder: Path | str | None = None,
    workers: int | str | None = 1,
    formats: Sequence[str] = DEFAULT_FORMATS,
    session: Session | None = None,
    **asked: Any,
) -> DrawnWorkspace:
    """Where a robot can work: kinds of workspaces, what they have in common, and measures.

    Args:
        robot: The robot, or its name or path.
        kinds: Names of `KINDS` of `analyses.workspaces.conditions`, such as static,
            wrench-feasible, interference-free.
        grid: Poses: a WorkspaceGrid, or numbers of points along x, y, z; None: as the robot's
            default grid.
        measures: Names of `MEASURES` of the same module. Kinds say inside or outside only;
            capacity-margin says how far, negative outside [N].
        orientations: Where kinds must hold: in all of the grid's orientations, or in any.
        box: Lower and upper corner in W, shape (3,) each, instead of the robot's frame [m]:
            where the default grid and certified boxes lie, and the hull ends.
        folder: Where finished work, results, figures and page are kept, and work is continued
            from; None: nowhere.
        workers: Processes, or the address of a Dask scheduler; None: one for each
            processor, started where more than ten seconds of work are left.
        formats: Endings of the files of figures.
        session: Who follows it and may stop it; None: nobody.
        asked: What kinds shall be asked for: `limits` (2,) [N], `mass` [kg], `wrench` (6,)
            [N m, N], `force` [N] and `moment` [N m] to resist along and about each axis, or
            `required`, a SpatialSet or a file; `accelerations`, `velocities`, `clearance` [m],
            `obstacles`, rows of boxes, `Obstacles` or a file; `exit_free`, `anchor_free` [m],
            `scenario`, `pulleys`, `method`, see `WorkspaceRequest` and `interference_bodies`. And
            what else is found: `hull` (3,) [m], `certify` and more fields of `ShapeRequest`.

    Raises:
        StoppedError: The session stopped it before the grid was finished.
        CdprError: Something is unknown, missing, out of range, or not possible for the robot.
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
    """
    told, (count, scheduler) = session or Session(), asked_workers(workers)
    shapes = ShapeRequest(**{name: asked.pop(name) for name in SHAPES if name in asked})
    box = None if box is None else _corners(box)
    shapes.check(box)
    question = workspace_question(
        robot, kinds, grid, measures=measures, orientations=orientations, box=box, **asked
    )
    loaded = as_robot(robot, "compute_workspace")
    search = None
    if shapes.certify:
        search = box_search(question, loaded, (shapes.exit_error, shapes.anchor_error), box)
    hull = bound = boxes = finer = None
    if shapes.hull is not None:
        bound = hull_bound(loaded, box, shapes.unbounded)
        with told.doing("Casting rays"):
            hull = question_hull(
                question, loaded, np.asarray(shapes.hull, float), shapes.rays, shapes.tolerance,
                bound,
            )  # fmt: skip
    with nullcontext() if folder is None else kept_folder(folder, told) as where:
        with told.computing():
            run = robot_workspace(question, where, count, scheduler, told.progress, told.stop)
        if run.workspace is None:
            raise stopped(run.progress)
        if search is not None:
            with told.computing("certify"):
                boxes = _certified(search, shapes.boxes, where, told)
                if shapes.refine is not None and boxes.finished:
                    finer = _refined(boxes, search, shapes, where, told)
                    boxes = finer.boxes
        found = as_kind(
            DrawnWorkspace, run.workspace, robot=loaded, hull=hull, bound=bound, boxes=boxes,
            search=search, folder=where, refined=finer,
            agreement={} if boxes is None else agreements(run.workspace, hull, boxes),
        )  # fmt: skip
        if where is None and shapes.mesh is None and shapes.boxes_mesh is None:
            return found
        with told.doing("Writing results"):
            if hull is not None and shapes.mesh is not None:
                with whole_file(Path(shapes.mesh)) as part:
                    write_hull(hull, part)
            if boxes is not None and shapes.boxes_mesh is not None:
                with whole_file(Path(shapes.boxes_mesh)) as part:
                    write_boxes(boxes, part)
            failed = {} if where is None else found.write(where, formats, told.say)
    return replace(found, failed=failed)


def _certified(
    search: BoxSearch, most: int, folder: Path | None, session: Session
) -> CertifiedBoxes:
    """Certified boxes; where the session stops the search, what is proven by then."""
    tell = _box_progress(session, most)
    return certified_boxes(search, most, folder, on_progress=tell, should_stop=session.stop)


def _refined(
    found: CertifiedBoxes, search: BoxSearch, shapes: ShapeRequest, folder: Path | None,
    session: Session,
) -> RefinedBoxes:  # fmt: skip
    """The same cut further along a way; where the session stops it, what is proven by then."""
    most = shapes.refine_boxes
    return refined_boxes(
        found, search, np.asarray(shapes.refine, float), shapes.refine_reach, most, folder,
        on_progress=_box_progress(session, most), should_stop=session.stop,
    )  # fmt: skip


def _box_progress(session: Session, most: int) -> Callable[[int, float], None]:
    """What tells a session how many boxes of so many are judged."""
    begin = time.monotonic()

    def tell(judged: int, open_share: float) -> None:
        passed, words = time.monotonic() - begin, f"{open_share:.1%} open"
        session.progress(WorkProgress(words, judged, most, passed, rate="boxes/s", items="boxes"))

    return tell


def stopped(progress: WorkProgress) -> StoppedError:
    """What is raised of work that a session stopped there."""
    return StoppedError(f"stopped after {progress.done} of {progress.total} {progress.items}")


def wrench_box(force: float | None, moment: float | None) -> SpatialSet:
    """Wrenches up to a force along each axis [N] and a moment about each [N m]; None: none.

    Raises:
        WorkspaceError: One is negative or not finite.
    """
    for name, value in (("force", force), ("moment", moment)):
        if value is not None and not (math.isfinite(value) and value >= 0.0):
            raise WorkspaceError(f"{name}: found {value:g}; accepted: a finite number >= 0")
    return SpatialSet(box=np.array([*[moment or 0.0] * 3, *[force or 0.0] * 3]))


def _corners(box: Box) -> Box:
    low, high = (np.asarray(corner, float) for corner in box)
    if low.shape != (3,) or high.shape != (3,) or not np.all(low < high):
        raise WorkspaceGridError("box: accepted: lower below upper corner, shape (3,) each [m]")
    return low, high


def _name(robot: Robot | str | Path) -> str:
    return robot.name if isinstance(robot, Robot) else str(robot)


def _words(names: str | Sequence[str]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else tuple(names)
