"""Exit points of a robot on rails, put where a task is done best, and proven there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import pandas as pd
from cyclopts import Parameter, Token
from pydrake.math import RigidTransform

from cdpr_drake.analyses.design.rails import load_rails, put_rails, rails_of
from cdpr_drake.analyses.frame.folder import Folder, results_folder, write_result
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Formats,
    InputFile,
    Limits,
    OutFolder,
    RobotWord,
    Switch,
    one_of,
    words,
)
from cdpr_drake.analyses.frame.words import poses as parse_poses
from cdpr_drake.analyses.kinematics import pose_numbers
from cdpr_drake.analyses.planning.path_files import path_poses
from cdpr_drake.analyses.planning.robot_path_task import make_path, pose_in_degrees
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.workspaces.robot_conditions import static_case
from cdpr_drake.analyses.workspaces.workspace_files import load_wrench_set
from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError, WrenchSetError, accepted_names
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.robot_loader import as_robot, load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_pose
from cdpr_drake.planning.reconfiguration import (
    STARTS,
    RailsSolution,
    RailTask,
    ReconfigurationProgram,
    tension_margins,
)
from cdpr_drake.planning.resistance import wrench_words
from cdpr_drake.proofs.box_expansion_kernel import INSIDE
from cdpr_drake.proofs.box_judges import CertifiedKind, CertifyTask
from cdpr_drake.proofs.certified_boxes import PoseBox, certify
from cdpr_drake.schema.typed_yaml import dump_typed
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.static_feasibility import StaticCase, wrench_matrices

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MARGIN, TENSION = "margin", "tension"
RAIL_GOALS = (MARGIN, TENSION)
"""What is best: the largest margin of tensions to their limits, or the least largest tension."""

AROUND, TURN, BOXES = 0.01, 1.0, 20_000
"""Defaults: half widths of the box of poses that is proven around each [m, deg], and how many boxes
of it are judged."""

SAMPLES = 9
"""Poses of a path that are checked by default."""

SUMMARY, ROBOT_FILE = "summary.json", "robot.yaml"

PALE, DARK = "0.7", "0.15"
"""Greys of the figure."""

MISSED = 1e-7
"""Margins that are missed by less are kept: tolerance of the program."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Reconfiguration(Result):
    """A robot whose exit points were moved along rails for a task.

    Attributes:
        before: The robot as it was.
        after: As it should be.
        task: Poses, wrenches and rails.
        goal: One of `RAIL_GOALS`.
        solution: What the program found.
        rails: A row for each rail: names of its cables, coordinates and ends [m].
        poses: A row for each pose: margins under its worst wrench of straight cables before and
            now, and over pulleys [-]; least largest tension now [N]; the kind of `cdpr workspace
            --certify` and which shares of the box around the pose are proven inside and outside.
        proven: True if the boxes around all poses are proven.
        around: Half widths of these boxes [m, deg].
        folder: Results folder; None if nothing was kept.
        failed: Of files that could not be written, the name and why.
    """

    before: Robot
    after: Robot
    task: RailTask
    goal: str
    solution: RailsSolution
    rails: pd.DataFrame
    poses: pd.DataFrame
    proven: bool
    around: tuple[float, float]
    folder: Path | None = None
    failed: dict[str, str] = field(default_factory=dict)

    @property
    def geometry(self) -> str:
        """Geometry of the cables in words: program and proof are for fixed exit points."""
        words = self.before.geometry_words(pulleys=False)
        if not self.before.cable_set().has_pulleys():
            return words
        return f"{words} by program and proof; margins also {self.before.geometry_words()}"

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        poses = self.poses
        result: dict[str, Any] = finite({
            "robot": self.before.name,
            "geometry": self.geometry,
            "goal": self.goal,
            "rails": self.rails.to_dict("records"),
            "least_margin_before": float(poses["margin_before"].min()),
            "least_margin": float(poses["margin"].min()),
            "least_margin_over_pulleys": float(poses["margin_over_pulleys"].min()),
            "largest_tension_n": float(poses["largest_tension_n"].max()),
            "wrenches": self.task.loads().shape[1],
            "solver": self.solution.solver,
            "proven": self.proven,
            "proven_around_m_deg": list(self.around),
            "poses": poses.to_dict("records"),
        })  # fmt: skip
        return result

    def tables(self) -> list[Table]:
        """Rails."""
        title = f"{self.before.name}: exit points moved along rails"
        return [Table(title, ("cables", "from [m]", "to [m]", "ends [m]"), [
            (rail.cables, f"{rail.from_m:.4f}", f"{rail.to_m:.4f}",
             f"{rail.lower_m:g} to {rail.upper_m:g}")
            for rail in self.rails.itertuples()
        ])]  # fmt: skip

    def lines(self) -> list[str]:
        """Margins, tensions and proofs."""
        poses, (position, turn) = self.poses, self.around
        least = poses[["margin_before", "margin", "margin_over_pulleys"]].min()
        verdict = "proven"
        if not self.proven:
            verdict = f"NOT PROVEN, {poses['proven_inside'].min():.1%} at the worst pose"
        return [
            f"cables: {self.geometry}",
            f"least margin of {len(poses)} poses under {self.task.loads().shape[1]} wrenches: "
            f"{least['margin_before']:.4f} before, {least['margin']:.4f} now, "
            f"{least['margin_over_pulleys']:.4f} over pulleys, of half the range of tensions; "
            f"tensions to {poses['largest_tension_n'].max():.4g} N do",
            f"all poses within {position:g} m, {turn:g} deg of each: {verdict}",
            *([] if self.folder is None else [f"robot: {self.folder / ROBOT_FILE}"]),
        ]

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """Rails, exit points before and after, and margins of all poses."""
        return {"rails": self._draw}

    def _draw(self) -> Figure:
        from cdpr_drake.analyses.frame.figures import bare_figure, styled

        figure = bare_figure(
            (11.0, 6.0),
            f"{self.before.name}: exit points on rails, before and after, and margins\n"
            f"{self.geometry}",
        )
        with styled():
            # A column between them: labels of axes in space are outside what a layout counts.
            grid = figure.add_gridspec(1, 3, width_ratios=(1.2, 0.08, 1.0))
            self._draw_rails(figure.add_subplot(grid[0], projection="3d"))
            self._draw_margins(figure.add_subplot(grid[2]))
        return figure

    def _draw_rails(self, space: Any) -> None:
        """Rails, exit points before and after with cables to the first pose."""
        rails, task = self.task.rails, self.task
        before, after = (rails.exit_points(at) for at in (rails.at, self.solution.coordinates))
        ends = rails.exit_points(rails.lower), rails.exit_points(rails.upper)
        for k in range(before.shape[1]):
            rail = np.array([ends[0][:, k], ends[1][:, k]]).T
            if np.any(rail[:, 0] != rail[:, 1]):
                space.plot(*rail, color=PALE, linewidth=4.0, label="rail" if k == 0 else None)
        space.plot(*before, "o", color=DARK, markerfacecolor="none", label="exit point before")
        space.plot(*after, "o", color=DARK, label="exit point after")
        X = task.poses[0]
        p_WB = X.translation()[:, None] + X.rotation().matrix() @ task.case.cables.p_PB
        for k in range(before.shape[1]):
            label = "cable at pose 1" if k == 0 else None
            space.plot(*np.array([after[:, k], p_WB[:, k]]).T, "-", linewidth=0.8, color=DARK,
                       label=label)  # fmt: skip
        places = np.array([Y.translation() for Y in task.poses]).T
        space.plot(*places, "x", color=DARK, label="Po at the poses")
        space.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
        space.set_aspect("equal")
        space.legend(loc="upper left", bbox_to_anchor=(-0.2, 1.05), ncols=1, fontsize="small")

    def _draw_margins(self, bars: Any) -> None:
        """Margins of all poses before and after."""
        number, poses = np.arange(1, len(self.poses) + 1), self.poses
        bars.bar(number - 0.2, poses["margin_before"], 0.4, color="white", edgecolor=DARK,
                 hatch="//", label="before")  # fmt: skip
        bars.bar(number + 0.2, poses["margin"], 0.4, color=DARK, edgecolor=DARK, label="after")
        bars.plot(
            number + 0.2, poses["margin_over_pulleys"], "D", color="white", markeredgecolor=DARK,
            markersize=5.0, linestyle="none", label="after, over pulleys",
        )  # fmt: skip
        bars.axhline(0.0, color=DARK, linewidth=0.8)
        bars.set(
            xlabel="pose", ylabel="margin under the worst wrench,\nshare of half the range [-]"
        )
        bars.set_xticks(number)
        bars.legend(loc="best")

    def write(self, folder: Folder) -> None:
        """Writes the robot file and the summary."""
        folder.write_text(ROBOT_FILE, dump_typed(self.after))
        load_robot(str(folder.path / ROBOT_FILE))
        folder.write_json(SUMMARY, self.as_dict())


def _pose_words(kind: Any, tokens: Sequence[Token]) -> Any:
    """Poses behind --poses, a file behind --path."""
    if tokens[0].keyword == "--path":
        return Path(tokens[0].value)
    return _POSES.converter(kind, tokens)  # type: ignore[misc, operator]


_POSES = words(
    parse_poses, "poses x,y,z or x,y,z,phi,theta,psi [m, deg] with ; between them", "POSES"
)

PosesWord = Annotated[
    Any,
    Parameter(name=("--poses", "--path"), converter=_pose_words, n_tokens=1, metavar="POSES|FILE"),
]


@verb()
def reconfigure(
    robot: RobotWord, *, poses: PosesWord, rails: InputFile = None, samples: int = SAMPLES,
    resist: InputFile = None, goal: Annotated[str, one_of(RAIL_GOALS)] = MARGIN,
    limits: Limits = None, starts: int = STARTS, around: float = AROUND, turn: float = TURN,
    boxes: int = BOXES, folder: OutFolder = None, overwrite: Switch = False,
    formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Reconfiguration:  # fmt: skip
    """Places exit points along rails so that poses or a path are feasible or best, with a proof.

    If no position on the rails works, the message names the pose and the wrench. Cables are taken
    as straight from their exit points; whether they collide is not checked.

    Args:
        robot: Robot by name or file.
        poses: Poses x,y,z or x,y,z,phi,theta,psi [m, deg] with ; between them, or a path: a file,
            CSV or G-code as of cdpr plan --path.
        rails: YAML file of rails: cables, axis, lower, upper; default: those of the robot file.
        samples: Number of poses of a path that are checked, on straight lines and arcs.
        resist: Wrenches to resist at each pose [N m, N], YAML as of cdpr plan --resist.
        goal: margin: the largest margin of tensions; tension: the least largest tension.
        limits: Smallest and largest tension [N]; default: the robot's.
        starts: Number of starting points of the optimisation.
        around: Half width of the box of positions that is proven around each pose [m].
        turn: Half width of the angles that are proven around each pose [deg].
        boxes: Largest number of boxes to judge for each pose.
        folder: Results folder, with robot.yaml, which has the new exit points, summary.json and a
            figure; default: rails/ROBOT, or ROBOT-2, ...; in Python nothing is kept.
        overwrite: Replace earlier results in the folder.
        formats: Formats of the figure in the folder.
        follow: Who follows the work.

    Raises:
        PlanningError: No position of the rails does it, or an argument is not accepted.
        CdprError: A file cannot be read, or the robot is not accepted.
        OutputFolderError: The folder holds other results or files, or cannot be written.
    """
    if starts < 1:
        raise PlanningError(f"starts: found {starts}; accepted: at least 1")
    if not (around > 0.0 and turn >= 0.0 and boxes >= 1):
        raise PlanningError(
            f"around: found {around:g} m, {turn:g} deg, {boxes} boxes; accepted: above 0, at least "
            "0, at least 1"
        )
    if goal not in RAIL_GOALS:
        raise PlanningError(f"goal: found {goal!r}; {accepted_names(goal, RAIL_GOALS)}")
    before, groups = as_robot(robot, "reconfigure"), list[list[str]]()
    if rails is not None:
        of_file = isinstance(rails, str | Path)
        settings = load_rails(Path(rails)) if of_file else list(rails)
        before = put_rails(before, settings, str(rails) if of_file else "rails")
        groups = [list(rail.cables) for rail in settings]
        moved = {name for group in groups for name in group}
        for cable in before.cables:  # rails that are given take the place of all of the robot's
            if cable.rail is not None and cable.name not in moved:
                cable.exit_point, cable.rail = cable.exit_point + cable.rail.shift(), None
    X_WP = _task_poses(before, poses, samples)
    required = load_wrench_set(Path(resist)) if isinstance(resist, str | Path) else resist
    arguments = {
        "robot": before.name, "rails": str(rails), "poses": [pose_in_degrees(X) for X in X_WP],
        "resist": str(resist), "goal": goal, "limits": limits, "starts": starts,
        "around": [around, turn, boxes],
    }  # fmt: skip
    name = f"rails/{before.name}"
    with results_folder(name, arguments, folder, overwrite, follow.results) as results:
        track, names = rails_of(before, groups)
        task = RailTask(static_case(before, limits, pulleys=False), track, X_WP, required)
        try:
            task.loads()
        except WrenchSetError as problem:
            if required is resist:
                raise
            raise WrenchSetError(f"{resist}: {problem}") from problem
        follow.doing(f"Moving exit points of {before.name}")
        solution = _best_coordinates(task, goal, starts)
        after = _moved(before, names, solution.coordinates)
        follow.doing("Proving what is around the poses")
        case = static_case(after, limits, pulleys=False)
        kind = CertifiedKind.STATIC if required is None else CertifiedKind.WRENCH_FEASIBLE
        claim = CertifyTask(kind, case, required or SpatialSet())
        proofs = [certify(claim, _box_around(case, X, around, turn), boxes) for X in X_WP]
        before_margins, margins = (
            np.min(task.margins(at), axis=1) for at in (track.at, solution.coordinates)
        )
        result = Reconfiguration(
            before=before, after=after, task=task, goal=goal, solution=solution,
            rails=pd.DataFrame({
                "cables": names, "from_m": track.at, "to_m": solution.coordinates,
                "lower_m": track.lower, "upper_m": track.upper,
            }),
            poses=pd.DataFrame({
                **pd.DataFrame([pose_numbers(X) for X in X_WP]), "margin_before": before_margins,
                "margin": margins, "margin_over_pulleys": _over_pulleys(task, after, limits),
                "largest_tension_n": np.max(task.largest_tensions(solution.coordinates), axis=1),
                "kind": kind.value,
                "proven_inside": [proof.inside for proof in proofs],
                "proven_outside": [proof.outside for proof in proofs],
            }),
            proven=all(bool(np.all(proof.verdicts == INSIDE)) for proof in proofs),
            around=(around, turn), folder=None if results is None else results.path,
        )  # fmt: skip
        if results is not None:
            write_result(result, results, formats, follow)
        return result


def _task_poses(robot: Robot, poses: Any, samples: int) -> list[RigidTransform]:
    """Poses themselves, or `samples` of a path from a file."""
    if not isinstance(poses, Path | str):
        if not len(poses):
            raise PlanningError("poses: found none; accepted: at least 1")
        return [as_pose(robot, pose) for pose in poses]
    if samples < 2:
        raise PlanningError(f"samples: found {samples}; accepted: at least 2")
    read = path_poses(robot, poses)
    path = make_path(robot, read.poses, "rest", moves=read.moves)
    return [path.pose(float(s)) for s in np.linspace(0.0, path.length, samples)]


def _best_coordinates(task: RailTask, goal: str, starts: int) -> RailsSolution:
    """Coordinates of the rails; refuses if no position of theirs does it."""
    program = ReconfigurationProgram(task)
    program.AddLargestMargin()
    solution = program.Solve(starts)
    margins = task.margins(solution.coordinates)
    if not np.min(margins) >= -MISSED:
        raise PlanningError(_impossible(task, margins))
    if goal == TENSION:
        program = ReconfigurationProgram(task)
        program.AddLeastLargestTension()
        solution = program.Solve(starts)
    if not solution.success:
        raise PlanningError(
            f"rails: {solution.solver}: {solution.status}; accepted: other rails or poses"
        )
    return solution


def _impossible(task: RailTask, margins: Array) -> str:
    k, c = divmod(int(np.argmin(margins)), margins.shape[1])
    corners = np.zeros((1, 6))
    if task.required is not None:
        rows = task.required.corners(task.case.rows)
        corners = np.zeros((len(rows), 6))
        corners[:, list(task.case.rows)] = rows
    place = ", ".join(f"{x:.4g}" for x in task.poses[k].translation())
    return (
        f"rails: found none of their positions for pose {k + 1} of {len(task.poses)}, ({place}) m, "
        f"under the wrench {wrench_words(corners[c])}: tensions miss their limits by "
        f"{-margins[k, c]:.3g} of half the range where they come nearest; accepted: poses and "
        "wrenches that some position can bear"
    )


def _moved(robot: Robot, names: list[str], coordinates: Array) -> Robot:
    result = deepcopy(robot)
    by_name = {cable.name: cable for cable in result.cables}
    for group, value in zip(names, coordinates, strict=True):
        for name in group.split(","):
            rail = by_name[name].rail
            assert rail is not None
            rail.at = float(min(max(value, rail.lower), rail.upper))
    return result


def _over_pulleys(task: RailTask, robot: Robot, limits: tuple[float, float] | None) -> Array:
    case = static_case(robot, limits)
    R = np.array([X.rotation().matrix() for X in task.poses])
    p = np.array([X.translation() for X in task.poses])
    W = wrench_matrices(p, R, case.cables)[:, list(case.rows)]
    return np.asarray(np.min(tension_margins(case, W, task.loads()), axis=1))


def _box_around(case: StaticCase, X_WP: RigidTransform, distance: float, turn: float) -> PoseBox:
    """Poses within a distance [m] and angles [deg] of a pose."""
    middle = np.concatenate([X_WP.translation(), angles_from_rotation(X_WP.rotation())])
    half = np.zeros(6)
    for row in case.rows:
        half[row + 3 if row < 3 else row - 3] = np.radians(turn) if row < 3 else distance
    return PoseBox(middle - half, middle + half)
