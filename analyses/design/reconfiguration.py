"""Exit points of a robot on rails, put where a task is done best, and proven there.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.common.yaml import yaml_dump_typed
from pydrake.math import RigidTransform

from cdpr_drake.analyses.reporting.log_files import finite, write_json, write_whole
from cdpr_drake.analyses.workspaces.robot_conditions import static_case
from cdpr_drake.arrays import Array
from cdpr_drake.errors import DataFileError, PlanningError, accepted_names
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.exit_points import Rail
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.planning.reconfiguration import (
    Rails,
    RailsSolution,
    RailTask,
    ReconfigurationProgram,
    tension_margins,
)
from cdpr_drake.planning.resistance import wrench_words
from cdpr_drake.schema.fields import array, number, sections, texts
from cdpr_drake.schema.typed_yaml import closest, load_typed
from cdpr_drake.summaries import Summarized, numbers
from cdpr_drake.workspaces.box_expansion_kernel import INSIDE
from cdpr_drake.workspaces.box_judges import CertifiedKind, CertifyTask
from cdpr_drake.workspaces.certified_boxes import PoseBox, certify
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.static_feasibility import wrench_matrices

MARGIN, TENSION = "margin", "tension"
RAIL_GOALS = (MARGIN, TENSION)
"""What is best: the largest margin of tensions to their limits, or the least largest tension."""

AROUND, TURN, BOXES = 0.01, 1.0, 20_000
"""Without other words: half widths of the box of poses round each that is proven [m, deg], and how
many boxes of it are judged."""

SUMMARY, ROBOT_FILE = "summary.json", "robot.yaml"

MISSED = 1e-7
"""Margins that are missed by less are kept: tolerance of the program."""


@dataclass(kw_only=True)
class RailSettings:
    """A straight rail; exit points of several cables on it move together."""

    cables: list[str] = texts("Cables that leave from it.")
    axis: np.ndarray = array(
        "Direction in W in which the coordinate grows; of any length.", "-", (3,)
    )
    lower: float = number("Smallest coordinate, counted from where the robot has its points.", "m")
    upper: float = number("Largest coordinate.", "m")


@dataclass(kw_only=True)
class RailFile:
    """Rails that a robot file does not have."""

    rails: list[RailSettings] = sections("The rails.")


def load_rails(path: Path) -> list[RailSettings]:
    """Reads rails; keys as `RailFile`.

    Raises:
        DataFileError: The file cannot be read, or a value is not accepted.
    """
    if not path.is_file():
        raise DataFileError(f"{path}: there is no such file of rails")
    return load_typed(RailFile, path).rails


def put_rails(robot: Robot, rails: Sequence[RailSettings], source: str = "rails") -> Robot:
    """A robot with these rails in the place of its own, its points where they are.

    Raises:
        PlanningError: A cable is unknown, on two rails, or a rail has no direction or length.
    """
    found, names = deepcopy(robot), [cable.name for cable in robot.cables]
    taken: set[str] = set()
    for k, rail in enumerate(rails):
        where = f"{source}: rails[{k}]"
        if not np.any(rail.axis) or not rail.lower < rail.upper:
            raise PlanningError(
                f"{where}: found axis ({numbers(rail.axis)}), {rail.lower:g} to {rail.upper:g} m; "
                "accepted: an axis that is not zero, lower < upper"
            )
        if not rail.cables:
            raise PlanningError(f"{where}.cables: found none; accepted: names of cables")
        for name in rail.cables:
            if name not in names:
                raise PlanningError(f"{where}.cables: {name!r} is unknown; {closest(name, names)}")
            if name in taken:
                raise PlanningError(f"{where}.cables: found {name} again; accepted: once")
            taken.add(name)
            cable = found.cables[names.index(name)]
            cable.exit_point = robot.cable_set().p_WA[:, names.index(name)]
            cable.rail = Rail(axis=np.array(rail.axis), lower=rail.lower, upper=rail.upper)
    return found


def rails_of(robot: Robot, groups: Sequence[Sequence[str]] = ()) -> tuple[Rails, list[str]]:
    """Rails of a robot's file, and names of their coordinates.

    Args:
        robot: The robot.
        groups: Names of cables that move together; all others that have rails move alone.

    Raises:
        PlanningError: It has none.
    """
    on_rails = {
        cable.name: (k, cable.rail)
        for k, cable in enumerate(robot.cables)
        if cable.rail is not None
    }
    if not on_rails:
        raise PlanningError(
            f"robot {robot.name}: found no cables[].rail; accepted: rails in its file, or --rails"
        )
    grouped = {name for group in groups for name in group}
    together = [*groups, *([name] for name in on_rails if name not in grouped)]
    rows: list[tuple[float, float, float]] = []
    directions = np.zeros((len(together), 3, len(robot.cables)))
    for direction, group in zip(directions, together, strict=True):
        for name in group:
            k, rail = on_rails[name]
            direction[:, k] = rail.axis / np.linalg.norm(rail.axis)
        rows.append((rail.lower, rail.upper, rail.at))
    lower, upper, at = np.array(rows).T
    bases = np.array([cable.exit_point for cable in robot.cables], float).T
    return Rails(directions, lower, upper, at, bases), [",".join(group) for group in together]


@dataclass(frozen=True)
class Around:
    """Boxes of poses that are proven, one round each pose of a task.

    Attributes:
        position: Half width along each axis that the platform can move along [m].
        turn: Half width of each angle that it can turn by [deg].
        boxes: Boxes that are judged, at most, for each pose.
    """

    position: float = AROUND
    turn: float = TURN
    boxes: int = BOXES


@dataclass(frozen=True)
class PoseProof:
    """What is proven round a pose.

    Attributes:
        kind: Kind of `cdpr workspace --certify`.
        inside: Share of the box that is proven inside.
        outside: Share that is proven outside.
        proven: Whether all of it is inside.
    """

    kind: str
    inside: float
    outside: float
    proven: bool


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Reconfiguration(Summarized):
    """A robot whose exit points were moved along rails for a task.

    Attributes:
        before: The robot as it was.
        after: As it should be.
        task: What was asked.
        goal: One of `RAIL_GOALS`.
        names: Cables of each rail.
        solution: What the program found.
        margins: Of each pose under its worst wrench, as it was and as it is, shape (2, n), straight
            cables.
        over_pulleys: Margins of the new robot over its pulleys, shape (n,).
        tensions: Least largest tension of each pose under its worst wrench now, shape (n,) [N].
        proofs: What is proven round each pose.
        around: Where.
    """

    before: Robot
    after: Robot
    task: RailTask
    goal: str
    names: list[str]
    solution: RailsSolution
    margins: Array
    over_pulleys: Array
    tensions: Array
    proofs: list[PoseProof]
    around: Around

    @property
    def geometry(self) -> str:
        """Geometry of the cables in words: program and proof are for fixed exit points."""
        words = self.before.geometry_words(pulleys=False)
        if not self.before.cable_set().has_pulleys():
            return words
        return f"{words} by program and proof; margins also {self.before.geometry_words()}"

    @property
    def proven(self) -> bool:
        """Whether the boxes round all poses are proven."""
        return all(proof.proven for proof in self.proofs)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        rails = self.task.rails
        told: dict[str, Any] = finite({
            "robot": self.before.name,
            "geometry": self.geometry,
            "goal": self.goal,
            "rails": [
                {"cables": name, "from_m": a, "to_m": b, "lower_m": low, "upper_m": high}
                for name, a, b, low, high in zip(
                    self.names, rails.at.tolist(), self.solution.coordinates.tolist(),
                    rails.lower.tolist(), rails.upper.tolist(), strict=True,
                )
            ],
            "least_margin_before": float(np.min(self.margins[0])),
            "least_margin": float(np.min(self.margins[1])),
            "least_margin_over_pulleys": float(np.min(self.over_pulleys)),
            "largest_tension_n": float(np.max(self.tensions)),
            "wrenches": self.task.loads().shape[1],
            "solver": self.solution.solver,
            "proven": self.proven,
            "proven_around_m_deg": [self.around.position, self.around.turn],
            "poses": [
                {
                    "position_m": X.translation().tolist(),
                    "angles_deg": np.degrees(angles_from_rotation(X.rotation())).tolist(),
                    "margin_before": float(self.margins[0, k]),
                    "margin": float(self.margins[1, k]),
                    "margin_over_pulleys": float(self.over_pulleys[k]),
                    "largest_tension_n": float(self.tensions[k]),
                    "kind": proof.kind,
                    "proven_inside": proof.inside,
                    "proven_outside": proof.outside,
                }
                for k, (X, proof) in enumerate(zip(self.task.poses, self.proofs, strict=True))
            ],
        })  # fmt: skip
        return told

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        rails = self.task.rails
        moved = [
            f"{name}: {a:.4g} to {b:.4g} m"
            for name, a, b in zip(self.names, rails.at, self.solution.coordinates, strict=True)
        ]
        before, now = np.min(self.margins, axis=1)
        inside = min(proof.inside for proof in self.proofs)
        return f"{self.before.name}, exit points moved along rails", [
            ("rails", "; ".join(moved)),
            ("margin", f"{before:.4f} before, {now:.4f} now, of half the range"),
            ("geometry", self.geometry),
            ("over pulleys", f"{np.min(self.over_pulleys):.4f}"),
            ("largest tension", f"{np.max(self.tensions):.4g} N"),
            ("proven", "all" if self.proven else f"{inside:.1%} round the worst pose"),
        ]

    def write(self, folder: Path) -> dict[str, Any]:
        """Writes summary and robot file into an existing folder; returns the summary."""
        write_whole(folder / ROBOT_FILE, yaml_dump_typed(self.after))
        load_robot(str(folder / ROBOT_FILE))
        told = self.as_dict()
        write_json(folder / SUMMARY, told)
        return told


def reconfigured(
    robot: Robot,
    poses: Sequence[RigidTransform],
    required: SpatialSet | None = None,
    groups: Sequence[Sequence[str]] = (),
    *,
    goal: str = MARGIN,
    limits: tuple[float, float] | None = None,
    starts: int = 5,
    around: Around | None = None,
    say: Callable[[str], None] | None = None,
) -> Reconfiguration:
    """Puts exit points of a robot along its rails for poses, and proves what is round these.

    Args:
        robot: The robot, with rails.
        poses: X_WP, at least one [m].
        required: Wrenches to resist at each; None: none beside the weight.
        groups: Cables that move together.
        goal: One of `RAIL_GOALS`.
        limits: Smallest and largest tension [N]; None: the robot's.
        starts: Of the program.
        around: Boxes of poses that are proven.
        say: Told what is done now.

    Raises:
        PlanningError: No position of the rails does it; names pose and wrench. Or something is not
            accepted.
        CdprError: The robot cannot be asked.
    """
    if goal not in RAIL_GOALS:
        raise PlanningError(f"goal: found {goal!r}; {accepted_names(goal, RAIL_GOALS)}")
    if starts < 1:
        raise PlanningError(f"starts: found {starts}; accepted: at least 1")
    where, tell = around or Around(), say or (lambda words: None)
    if not (where.position > 0.0 and where.turn >= 0.0 and where.boxes >= 1):
        raise PlanningError(
            f"around: found {where.position:g} m, {where.turn:g} deg, {where.boxes} boxes; "
            "accepted: above 0, at least 0, at least 1"
        )
    rails, names = rails_of(robot, groups)
    task = RailTask(static_case(robot, limits, pulleys=False), rails, list(poses), required)
    tell(f"Moving exit points of {robot.name}")
    program = ReconfigurationProgram(task)
    program.AddLargestMargin()
    found = program.Solve(starts)
    margins = task.margins(found.coordinates)
    if not np.min(margins) >= -MISSED:
        raise PlanningError(_impossible(task, margins))
    if goal == TENSION:
        program = ReconfigurationProgram(task)
        program.AddLeastLargestTension()
        found = program.Solve(starts)
        margins = task.margins(found.coordinates)
    if not found.success:
        raise PlanningError(
            f"rails: {found.solver}: {found.status}; accepted: other rails or poses"
        )
    after = _moved(robot, names, found.coordinates)
    case = static_case(after, limits, pulleys=False)
    tell("Proving what is round the poses")
    return Reconfiguration(
        before=robot, after=after, task=task, goal=goal, names=names, solution=found,
        margins=np.array([np.min(task.margins(rails.at), axis=1), np.min(margins, axis=1)]),
        over_pulleys=_over_pulleys(task, after, limits),
        tensions=np.max(task.largest_tensions(found.coordinates), axis=1),
        proofs=[_proof(case, X, required, where) for X in task.poses], around=where,
    )  # fmt: skip


def _impossible(task: RailTask, margins: Array) -> str:
    k, c = divmod(int(np.argmin(margins)), margins.shape[1])
    corners = np.zeros((1, 6))
    if task.required is not None:
        found = task.required.corners(task.case.rows)
        corners = np.zeros((len(found), 6))
        corners[:, list(task.case.rows)] = found
    place = ", ".join(f"{x:.4g}" for x in task.poses[k].translation())
    return (
        f"rails: found none of their positions for pose {k + 1} of {len(task.poses)}, ({place}) m, "
        f"under the wrench {wrench_words(corners[c])}: tensions miss their limits by "
        f"{-margins[k, c]:.3g} of half the range where they come nearest; accepted: poses and "
        "wrenches that some position can bear"
    )


def _moved(robot: Robot, names: list[str], coordinates: Array) -> Robot:
    found = deepcopy(robot)
    by_name = {cable.name: cable for cable in found.cables}
    for group, value in zip(names, coordinates, strict=True):
        for name in group.split(","):
            rail = by_name[name].rail
            assert rail is not None
            rail.at = float(min(max(value, rail.lower), rail.upper))
    return found


def _over_pulleys(task: RailTask, robot: Robot, limits: tuple[float, float] | None) -> Array:
    case = static_case(robot, limits)
    R = np.array([X.rotation().matrix() for X in task.poses])
    p = np.array([X.translation() for X in task.poses])
    W = wrench_matrices(p, R, case.cables)[:, list(case.rows)]
    return np.asarray(np.min(tension_margins(case, W, task.loads()), axis=1))


def _proof(
    case: Any, X_WP: RigidTransform, required: SpatialSet | None, around: Around
) -> PoseProof:
    """Boxes round a pose, of straight cables from the exit points."""
    kind = CertifiedKind.STATIC if required is None else CertifiedKind.WRENCH_FEASIBLE
    middle = np.concatenate([X_WP.translation(), angles_from_rotation(X_WP.rotation())])
    half = np.zeros(6)
    for row in case.rows:
        half[row + 3 if row < 3 else row - 3] = (
            np.radians(around.turn) if row < 3 else around.position
        )
    task = CertifyTask(kind, case, required or SpatialSet())
    boxes = certify(task, PoseBox(middle - half, middle + half), around.boxes)
    proven = bool(np.all(boxes.verdicts == INSIDE))
    return PoseProof(kind.value, boxes.inside, boxes.outside, proven)
