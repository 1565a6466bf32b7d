"""Proven sets of poses of a robot, and of poses and time among obstacles that move."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from cdpr_drake.analyses.workspaces.conditions import KINDS, PoseConditions, Poses
from cdpr_drake.analyses.workspaces.pose_grid import check_grid
from cdpr_drake.analyses.workspaces.robot_conditions import (
    as_obstacles,
    interference_bodies,
    pose_conditions,
)
from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.proofs.certified_workspace import BoxSearch, box_search
from cdpr_drake.proofs.proven_cells import CELLS, ProvenCells, prove_cells
from cdpr_drake.proofs.proven_connection import connect_poses, inside_cell
from cdpr_drake.proofs.proven_sets import COVER, PoseSets, sets_of_cells
from cdpr_drake.proofs.timed_cells import PoseRaster, clear_cells
from cdpr_drake.proofs.timed_sets import TimedSets, sets_in_time
from cdpr_drake.workspaces.cable_interference import PART_NAMES, Obstacles, clearances
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet, resisting, spatial_inertias
from cdpr_drake.workspaces.inertial_wrenches import moment_box, turning_wrenches
from cdpr_drake.workspaces.moving_shapes import MovingObstacle
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.wrench_capacity import capacity_margins

BOXES = 100_000
"""Boxes that are judged, where nobody says."""

POSE_CELLS = 2**15
"""Cells of poses, at most; each in `FEWEST_STEPS` to `MOST_STEPS` intervals of time."""

FEWEST_STEPS, MOST_STEPS = 32, 128
FINE = 24
"""Steps of time in the time of a straight motion, at least, within those limits."""

AFTER = 2.0
"""Times of a straight motion that are looked at after everything has come to rest, or is gone."""

LONGEST = 8.0
"""Times of a straight motion that are looked at where something moves for ever."""

LOOKS = 400
"""Instants at which it is looked whether something is still there."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ProofSettings:
    """How sets are proven.

    Attributes:
        boxes: Boxes that are judged, at most.
        cells: Cells of the raster on which boxes are merged, at most.
        clearance: Least clearance of cables and platform [m].
        limits: Smallest and largest tension; None: the robot's [N].
        pulleys: True: cables run over the robot's pulleys. False: from fixed exit points.
        exit_free: As of `interference_bodies` [m].
        anchor_free: Likewise [m].
    """

    boxes: int = BOXES
    cells: int = CELLS
    clearance: float = 0.0
    limits: tuple[float, float] | None = None
    pulleys: bool = True
    exit_free: float | None = None
    anchor_free: float | None = None


DEFAULT_PROOF = ProofSettings()


@dataclass(frozen=True, eq=False)
class ProvenSets(PoseSets):
    """Proven sets of a robot.

    Attributes:
        kinds: What holds everywhere in them.
        conditions: What the kinds know of the robot; None where the sets come from a file.
        cut: Open cells that were cut further to reach and connect poses.
    """

    kinds: tuple[str, ...] = ()
    conditions: PoseConditions | None = None
    cut: int = 0

    @staticmethod
    def find(
        robot: Robot | str, kinds: Sequence[str] | None = None, angles: Array | None = None,
        obstacles: Array | Obstacles | None = None, accelerations: Array | float | None = None, *,
        cover: float = COVER, must: Sequence[Array] | Mapping[str, Array] = (),
        settings: ProofSettings = DEFAULT_PROOF, say: Callable[[str], None] = lambda words: None,
    ) -> ProvenSets:  # fmt: skip
        """Finds sets of poses of a robot in which kinds of workspaces are proven.

        Args:
            robot: The robot, or its name or path.
            kinds: Names of `CertifiedKind`; None: all that a motion needs: tensions, and cables
                and platform clear.
            angles: Orientations (phi, theta, psi) from whose least to whose largest angles the sets
                go, shape (n, 3) [rad]; None: zero.
            obstacles: What cables and platform stay off, boxes, shape (o, 15), or these and convex
                shapes; None: nothing.
            accelerations: Half widths of a box of accelerations of Po in W, one or three, any of
                which the cables can give at every pose, for the kind wrench-feasible [m/s^2]. Where
                angles vary, six: of angular accelerations in P, and of accelerations of the centre
                of mass in W, with all gyroscopic terms, see `inertial_wrenches`
                [rad/s^2, m/s^2].
            cover: Share of what is proven that the sets cover.
            must: Poses in sets, shape (6,) each [m, rad], or these by the names that refusals
                begin with; where open cells keep them from each other, in their order, these are
                cut further.
            settings: How they are proven.
            say: Told what is done now.

        Raises:
            WorkspaceError: Something is not accepted, no pose is proven, or a pose of `must` is
                not: says which kind fails there, with numbers.
        """
        loaded = as_robot(robot, "proven sets")
        turned = np.zeros((1, 3)) if angles is None else np.asarray(angles, float).reshape(-1, 3)
        box, angular = _acceleration_box(accelerations)
        if box is not None and angular is None and np.any(np.ptp(turned, axis=0) > 0.0):
            raise WorkspaceError(
                "accelerations: found with a range of angles; accepted: one orientation, or six "
                "half widths (angular, linear), since a turn adds inertial terms that a box of "
                "accelerations of Po has not"
            )
        tensions = "static" if box is None else "wrench-feasible"
        names = tuple(kinds or (tensions, "interference-free", "collision-free"))
        if (box is not None) != ("wrench-feasible" in names):
            raise WorkspaceError(
                f"kinds {','.join(names)}: accepted: wrench-feasible with accelerations, and "
                "accelerations with wrench-feasible"
            )
        required = moments = None
        if box is not None and angular is not None:
            required, moments = _turning_wrenches(loaded, box, angular, turned)
        elif box is not None:
            required = accelerated_wrenches(loaded, box, turned[0])
        around = interference_bodies(
            loaded, obstacles, settings.exit_free, settings.anchor_free, settings.pulleys
        )
        about = pose_conditions(
            loaded, limits=settings.limits, required=required, clearance=settings.clearance,
            around=around, pulleys=settings.pulleys,
        )  # fmt: skip
        poses = dict(must) if isinstance(must, Mapping) else {
            f"must[{k}]": pose for k, pose in enumerate(must)
        }  # fmt: skip
        low, high = loaded.reach()
        if loaded.frame.assumed:  # which refuses no pose
            places = np.array([low, high, *(pose[:3] for pose in poses.values())])
            free = low < high
            low = np.where(free, places.min(axis=0), low)
            high = np.where(free, places.max(axis=0), high)
        x, y, z = (np.unique([a, b]) for a, b in zip(low, high, strict=True))
        grid = WorkspaceGrid((x, y, z), np.unique(turned, axis=0))
        check_grid(loaded, grid)
        search = box_search(loaded, about, names, grid.angles, region=(low, high))
        _check_poses(loaded, about, names, search, poses)
        cells, cut = _connected_cells(loaded, search, poses, settings, say)
        _check_cells(loaded, names, cells, poses)
        say(f"Merging boxes for {loaded.name}")
        lower, upper, merged = sets_of_cells(cells, cover, list(poses.values()))
        covered = np.zeros(cells.inside.shape, bool)
        for first, last in merged.tolist():
            covered[tuple(slice(a, b) for a, b in zip(first, last, strict=True))] = True
        words = {
            "robot": loaded.name, "kinds": list(names),
            "angles_rad": [turned.min(axis=0).tolist(), turned.max(axis=0).tolist()],
            "obstacles": [
                {"name": each.name, "points_m": each.points.tolist(), "radius_m": each.radius}
                for each in as_obstacles(obstacles).shapes()
            ],
            "accelerations_m_s2": None if box is None else box.tolist(),
            "tension_limits_n": [float(v) for v in loaded.tension_limits(settings.limits)],
            "clearance_m": settings.clearance,
            "cables": "over pulleys" if settings.pulleys else "from fixed exit points",
            "boxes_judged_at_most": settings.boxes,
        }  # fmt: skip
        if angular is not None and moments is not None:
            words |= {"angular_accelerations_rad_s2": angular.tolist(),
                      "moments_n_m": moments.tolist()}  # fmt: skip
        words |= {
            "proven_share": cells.share, "excluded_share": float(np.mean(cells.excluded)),
            "covered_share": float(np.count_nonzero(covered) / np.count_nonzero(cells.inside)),
            "raster": list(cells.inside.shape), "cells_cut_further": cut,
        }  # fmt: skip
        return ProvenSets(lower, upper, cells.axes, words, cells, names, about, cut)

    def judge(self, positions: Array, rotations: Array) -> dict[str, np.ndarray]:
        """Whether each kind holds at poses, by the exact checks of poses and not by the sets.

        The platform's clearance is among them also where the sets do not prove it.

        Args:
            positions: p_WP, shape (n, 3) [m].
            rotations: R_WP, shape (n, 3, 3).

        Raises:
            WorkspaceError: The sets come from a file.
        """
        if self.conditions is None:
            raise WorkspaceError(
                "proven sets: found sets of a file; accepted: sets that were found"
            )
        return _judged(self.conditions, self.kinds, positions, rotations)


def _acceleration_box(accelerations: Array | float | None) -> tuple[Array | None, Array | None]:
    """Half widths, linear [m/s^2] and angular [rad/s^2], shape (3,) each."""
    if accelerations is None:
        return None, None
    widths = np.asarray(accelerations, float).ravel()
    linear, angular = widths[-3:], widths[:3]
    good = widths.size in (1, 3, 6) and np.all(np.isfinite(widths)) and np.all(linear > 0.0)
    if not good or (widths.size == 6 and not (np.all(angular >= 0.0) and np.any(angular > 0.0))):
        raise WorkspaceError(
            f"accelerations: found {np.array2string(widths)}; accepted: one or three half widths, "
            "finite and above 0 [m/s^2], or three angular ones before these, at least 0, one of "
            "them above [rad/s^2]"
        )
    return np.array(np.broadcast_to(linear, 3)), angular if widths.size == 6 else None


def _turning_wrenches(
    robot: Robot, box: Array, angular: Array, angles: Array
) -> tuple[SpatialSet, Array]:
    """External wrenches that stand for all motions in a range of orientations, at any velocity,
    and half widths of the moments about the centre of mass in P, shape (3,) [N m]."""
    body, low, high = rigid_platform(robot), angles.min(axis=0), angles.max(axis=0)
    moments = moment_box(body.mass, body.p_PCo, body.I_PPo, angular)
    wrenches = turning_wrenches(
        body.mass, body.p_PCo, moments, box, 0.5 * (low + high), 0.5 * (high - low)
    )
    return wrenches, moments


def accelerated_wrenches(robot: Robot, box: Array, angles: Array) -> SpatialSet:
    """External wrenches about Po that stand for every acceleration in a box, without turns.

    With the centre of mass at c from Po, an acceleration a loads the cables as the wrench
    -(c x m a, m a) would, at any velocity.

    Args:
        robot: The robot.
        box: Half widths, shape (3,) [m/s^2].
        angles: The orientation (phi, theta, psi), shape (3,) [rad].
    """
    body = rigid_platform(robot)
    R = rotation_from_angles(angles).matrix()
    M = spatial_inertias(body.mass, body.p_PCo, body.I_PPo, R)[0]
    corners = np.array(list(product((-1.0, 1.0), repeat=3))) * box
    return SpatialSet(vertices=-corners @ M[:, 3:].T)


def _judged(
    about: PoseConditions, kinds: Sequence[str], positions: Array, rotations: Array
) -> dict[str, np.ndarray]:
    at = Poses(0, len(positions), positions, rotations)
    names = dict.fromkeys([*kinds, "collision-free"])
    return {name: KINDS[name].value(about, at) for name in names}


def explain_pose(sets: ProvenSets, pose: Array) -> str:
    """Which kinds fail at a pose by the exact checks, with numbers; empty: none does."""
    assert sets.conditions is not None
    return _failures(sets.conditions, sets.kinds, pose)


def _failures(about: PoseConditions, kinds: Sequence[str], pose: Array) -> str:
    p, R = pose[np.newaxis, :3], rotation_from_angles(pose[3:]).matrix()[np.newaxis]
    words = []
    for name, holds in _judged(about, kinds, p, R).items():
        if holds[0]:
            continue
        if name in ("static", "wrench-feasible"):
            required = about.required or SpatialSet()
            margin = capacity_margins(about.case, p, R, resisting(about.case, required, R)).margins
            words.append(f"{name} fails: capacity margin {margin[0]:.4g} N")
            continue
        gaps = clearances(about.around, p, R)[0]
        parts = range(4) if name == "interference-free" else range(4, 5)
        near = [f"{PART_NAMES[k]} {gaps[k]:.4g} m" for k in parts if not gaps[k] > about.clearance]
        words.append(f"{name} fails: {', '.join(near)}, needed above {about.clearance:g} m")
    return "; ".join(words)


def _pose_words(pose: Array) -> str:
    """Position [m] and angles [deg] as users write them."""
    return ",".join(f"{round(value, 4) + 0.0:g}" for value in [*pose[:3], *np.degrees(pose[3:])])


def _check_poses(
    robot: Robot, about: PoseConditions, kinds: Sequence[str], search: BoxSearch,
    poses: Mapping[str, Array],
) -> None:  # fmt: skip
    for name, pose in poses.items():
        words = f"{name}: found the pose {_pose_words(pose)}"
        if failing := _failures(about, kinds, pose):
            raise WorkspaceError(f"{words}: {failing}; accepted: where all hold")
        if np.any((pose < search.box.lower - 1e-9) | (pose > search.box.upper + 1e-9)):
            raise WorkspaceError(
                f"{words}: it lies outside the frame of {robot.name}, or at other angles; "
                "accepted: poses inside"
            )


def _connected_cells(
    robot: Robot, search: BoxSearch, poses: Mapping[str, Array], settings: ProofSettings,
    say: Callable[[str], None],
) -> tuple[ProvenCells, int]:  # fmt: skip
    """Proven cells, with those open ones cut further that keep poses apart, and their number."""

    def tell(judged: int, share: float) -> None:
        say(f"Proving poses of {robot.name}: {judged} boxes, {share:.1%} open")

    tasks = search.tasks
    cells = prove_cells(
        tasks, search.box, settings.boxes, tasks[0].case.arm(), settings.cells, tell
    )
    return connect_poses(
        cells, tasks, list(poses.values()),
        on_cut=lambda n: say(f"Cutting open cells for {robot.name}: {n}"),
    )  # fmt: skip


def _check_cells(
    robot: Robot, kinds: Sequence[str], cells: ProvenCells, poses: Mapping[str, Array]
) -> None:
    names = ", ".join(kinds)
    for name, pose in poses.items():
        if inside_cell(cells, pose) is None:
            raise WorkspaceError(
                f"{name}: found the pose {_pose_words(pose)}: all of {names} hold there, but are "
                f"not proven in a cell round it, {np.array2string(cells.width, precision=3)} wide; "
                "accepted: a pose farther from the border, or more boxes or cells"
            )
    if not np.any(cells.inside):
        raise WorkspaceError(
            f"proven sets of {robot.name}: found no cell in which all of {names} are proven; "
            "accepted: more boxes, smaller accelerations, another orientation"
        )


def find_timed_sets(
    robot: Robot, static: ProvenSets, things: Sequence[MovingObstacle], ends: tuple[Array, Array],
    whole: float, *, clearance: float = 0.0, say: Callable[[str], None] = lambda words: None,
) -> TimedSets:  # fmt: skip
    """Proves poses and times that are clear of what moves, among those that are proven otherwise.

    Args:
        robot: The robot.
        static: Sets in which all else is proven, with their cells.
        things: What moves.
        ends: Start at time 0 and goal, shape (6,) each [m, rad].
        whole: Time of a straight motion between them [s].
        clearance: Least clearance of cables and platform from what moves [m].
        say: Told what is done now.

    Raises:
        WorkspaceError: The sets have no cells, or as `sets_in_time`.
    """
    if static.cells is None or static.conditions is None:
        raise WorkspaceError("sets: found sets of a file; accepted: sets that were found")
    horizon = _horizon(robot, things, whole)
    steps = FEWEST_STEPS
    while steps < MOST_STEPS and horizon / steps > whole / FINE:
        steps *= 2

    def tell(judged: int, share: float) -> None:
        say(f"Proving poses and times of {robot.name}: {judged} boxes, {share:.1%} open")

    raster = PoseRaster.of(static.cells, POSE_CELLS)
    around = static.conditions.around
    cells = clear_cells(raster, around, things, clearance, horizon, steps, on_progress=tell)
    speed = float(np.linalg.norm(ends[1][:3] - ends[0][:3])) / whole
    about = {**static.about, "moving": [thing.name for thing in things]}
    return sets_in_time(cells, *ends, speed, about=about, say=say)


def _horizon(robot: Robot, things: Sequence[MovingObstacle], whole: float) -> float:
    """Until when poses are looked at [s]: for a while after all rests, or has left the frame.

    Proofs do not depend on it.
    """
    low, high = robot.reach()
    longest, last = LONGEST * whole, 0.0
    for thing in things:
        settled = thing.settled()
        until = settled if np.isfinite(settled) else longest
        times = np.linspace(0.0, until, LOOKS) if settled > 0.0 else np.zeros(0)
        near = [float(time) for time in times if _near(thing, float(time), low, high)]
        last = max([last, *near])
    forever = any(not np.isfinite(thing.settled()) for thing in things)
    return last if forever and last == longest else last + AFTER * whole


def _near(thing: MovingObstacle, time: float, low: Array, high: Array) -> bool:
    """True if some of it is in the frame."""
    return any(
        np.all(np.min(shape.points, axis=0) - shape.radius <= high)
        and np.all(low <= np.max(shape.points, axis=0) + shape.radius)
        for shape in thing.at(time)
    )
