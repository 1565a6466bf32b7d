"""Proven sets of poses of a robot: which kinds hold in all of each set, found and explained."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from cdpr_drake.analyses.workspaces.box_certificates import box_search
from cdpr_drake.analyses.workspaces.conditions import KINDS, PoseConditions, Poses
from cdpr_drake.analyses.workspaces.pose_grid import check_grid
from cdpr_drake.analyses.workspaces.robot_conditions import interference_bodies, pose_conditions
from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.workspaces.box_judges import CertifiedKind, CertifyTask
from cdpr_drake.workspaces.cable_interference import PART_NAMES, Obstacles, clearances
from cdpr_drake.workspaces.certified_boxes import PoseBox
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet, resisting, spatial_inertias
from cdpr_drake.workspaces.inertial_wrenches import moment_box, turning_wrenches
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.proven_cells import CELLS, prove_cells
from cdpr_drake.workspaces.proven_connection import connect_poses, inside_cell
from cdpr_drake.workspaces.proven_sets import COVER, PoseSets, sets_of_cells
from cdpr_drake.workspaces.wrench_capacity import capacity_margins

BOXES = 100_000
"""Boxes that are judged, where nobody says."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ProofSettings:
    """How sets are proven.

    Attributes:
        boxes: Boxes that are judged, at most.
        cells: Cells of the raster on which boxes are merged, at most.
        clearance: Least clearance of cables and platform [m].
        limits: Smallest and largest tension; None: the robot's [N].
        pulleys: Whether cables run over the robot's pulleys; else from fixed exit points.
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
    tasks: tuple[CertifyTask, ...] = field(default=(), repr=False)

    @staticmethod
    def find(
        robot: Robot | str,
        kinds: Sequence[str] | None = None,
        angles: Array | None = None,
        obstacles: Array | Obstacles | None = None,
        accelerations: Array | float | None = None,
        *,
        cover: float = COVER,
        must: Sequence[Array] | Mapping[str, Array] = (),
        settings: ProofSettings = DEFAULT_PROOF,
        say: Callable[[str], None] = lambda words: None,
    ) -> ProvenSets:
        """Finds sets of poses of a robot in which kinds of workspaces are proven.

        Args:
            robot: The robot, or its name or path.
            kinds: Names of `CertifiedKind`; None: all that a motion needs, see `motion_kinds`.
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
        box, angular = acceleration_box(accelerations)
        if box is not None and angular is None and np.any(np.ptp(turned, axis=0) > 0.0):
            raise WorkspaceError(
                "accelerations: found with a range of angles; accepted: one orientation, or six "
                "half widths (angular, linear), since a turn adds inertial terms that a box of "
                "accelerations of Po has not"
            )
        chosen = tuple(motion_kinds(box is not None) if kinds is None else kinds)
        if (box is not None) != ("wrench-feasible" in chosen):
            raise WorkspaceError(
                f"kinds {','.join(chosen)}: accepted: wrench-feasible with accelerations, and "
                "accelerations with wrench-feasible"
            )
        required = None if box is None else accelerated_wrenches(loaded, box, turned[0])
        moments = None
        if box is not None and angular is not None:
            moments = angular_moments(loaded, angular)
            required = turning_about(loaded, box, moments, turned)
        around = interference_bodies(
            loaded, obstacles, settings.exit_free, settings.anchor_free, settings.pulleys
        )
        about = pose_conditions(
            loaded, limits=settings.limits, required=required, clearance=settings.clearance,
            around=around, pulleys=settings.pulleys,
        )  # fmt: skip
        named = must if isinstance(must, Mapping) else {f"must[{k}]": p for k, p in enumerate(must)}
        low, high = loaded.reach()
        if loaded.frame.assumed:  # which refuses no pose
            places = np.array([low, high, *(pose[:3] for pose in named.values())])
            free = low < high
            low = np.where(free, places.min(axis=0), low)
            high = np.where(free, places.max(axis=0), high)
        axes = tuple(np.unique([a, b]) for a, b in zip(low, high, strict=True))
        grid = WorkspaceGrid((axes[0], axes[1], axes[2]), np.unique(turned, axis=0))
        check_grid(loaded, grid)
        search = box_search(loaded, about, chosen, grid.angles, region=(low, high))
        draft = ProvenSets(
            np.zeros((1, 6)),
            np.zeros((1, 6)),
            np.zeros(1, int),
            kinds=chosen,
            conditions=about,
            tasks=search.tasks,
            about=_about(loaded, chosen, turned, obstacles, box, settings)
            | _turning_told(angular, moments),
        )
        return _prove(loaded, search.box, draft, (cover, dict(named), settings), say)

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
        at = Poses(0, len(positions), positions, rotations)
        names = dict.fromkeys([*self.kinds, "collision-free"])
        return {name: KINDS[name].holds(self.conditions, at) for name in names}


def motion_kinds(accelerated: bool) -> list[str]:
    """Kinds that a motion needs: tensions, cables clear, and the platform clear if provable."""
    first = CertifiedKind.WRENCH_FEASIBLE if accelerated else CertifiedKind.STATIC
    known = [kind.value for kind in CertifiedKind]
    return [first.value, "interference-free", *(["collision-free"] * ("collision-free" in known))]


def acceleration_box(given: Array | float | None) -> tuple[Array | None, Array | None]:
    """Half widths, linear [m/s^2] and angular [rad/s^2], shape (3,) each; None: not given.

    Raises:
        WorkspaceError: They are not accepted.
    """
    if given is None:
        return None, None
    found = np.asarray(given, float).ravel()
    linear, angular = found[-3:], found[:3]
    good = found.size in (1, 3, 6) and np.all(np.isfinite(found)) and np.all(linear > 0.0)
    if not good or (found.size == 6 and not (np.all(angular >= 0.0) and np.any(angular > 0.0))):
        raise WorkspaceError(
            f"accelerations: found {np.array2string(found)}; accepted: one or three half widths, "
            "finite and above 0 [m/s^2], or three angular ones before these, at least 0, one of "
            "them above [rad/s^2]"
        )
    return np.array(np.broadcast_to(linear, 3)), angular if found.size == 6 else None


def angular_moments(robot: Robot, angular: Array) -> Array:
    """Moments about the centre of mass in P that angular accelerations ask, shape (3,) [N m]."""
    body = rigid_platform(robot)
    return moment_box(body.mass, body.p_PCo, body.I_PPo, angular)


def turning_about(robot: Robot, box: Array, moments: Array, angles: Array) -> SpatialSet:
    """External wrenches that stand for all motions in a range of orientations, at any velocity.

    Args:
        robot: The robot.
        box: Half widths of accelerations of the centre of mass in W, shape (3,) [m/s^2].
        moments: Half widths of moments about it in P, shape (3,) [N m].
        angles: Orientations between which it turns, shape (n, 3) [rad].
    """
    body, low, high = rigid_platform(robot), angles.min(axis=0), angles.max(axis=0)
    return turning_wrenches(
        body.mass, body.p_PCo, moments, box, 0.5 * (low + high), 0.5 * (high - low)
    )


def _turning_told(angular: Array | None, moments: Array | None) -> dict[str, Any]:
    if angular is None or moments is None:
        return {}
    return {
        "angular_accelerations_rad_s2": angular.tolist(), "moments_n_m": moments.tolist(),
    }  # fmt: skip


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


def explain_pose(sets: ProvenSets, pose: Array) -> str:
    """Which kinds fail at a pose by the exact checks, with numbers; empty: none does."""
    about = sets.conditions
    assert about is not None
    p, R = pose[np.newaxis, :3], rotation_from_angles(pose[3:]).matrix()[np.newaxis]
    words = []
    for name, holds in sets.judge(p, R).items():
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


def pose_words(pose: Array) -> str:
    """Position [m] and angles [deg] as users write them."""
    numbers = [*pose[:3], *np.degrees(pose[3:])]
    return ",".join(f"{round(value, 4) + 0.0:g}" for value in numbers)


def _prove(
    robot: Robot,
    box: PoseBox,
    draft: ProvenSets,
    how: tuple[float, dict[str, Array], ProofSettings],
    say: Callable[[str], None],
) -> ProvenSets:
    cover, must, settings = how
    names, tasks = draft.kinds, draft.tasks

    def tell(judged: int, share: float) -> None:
        say(f"Proving poses of {robot.name}: {judged} boxes, {share:.1%} open")

    for name, pose in must.items():
        found = f"{name}: found the pose {pose_words(pose)}"
        if failing := explain_pose(draft, pose):
            raise WorkspaceError(f"{found}: {failing}; accepted: where all hold")
        if np.any((pose < box.lower - 1e-9) | (pose > box.upper + 1e-9)):
            raise WorkspaceError(
                f"{found}: it lies outside the frame of {robot.name}, or at other "
                "angles; accepted: poses inside"
            )
    cells = prove_cells(tasks, box, settings.boxes, tasks[0].case.arm(), settings.cells, tell)
    cells, cut = connect_poses(
        cells,
        tasks,
        list(must.values()),
        on_cut=lambda n: say(f"Cutting open cells for {robot.name}: {n}"),
    )
    for name, pose in must.items():
        if inside_cell(cells, pose) is None:
            raise WorkspaceError(
                f"{name}: found the pose {pose_words(pose)}: all of {', '.join(names)} hold there, "
                "but are not proven in "
                f"a cell round it, {np.array2string(cells.width, precision=3)} wide; accepted: a "
                "pose farther from the border, or more boxes or cells"
            )
    if not np.any(cells.inside):
        raise WorkspaceError(
            f"proven sets of {robot.name}: found no cell in which all of {', '.join(names)} are "
            "proven; accepted: more boxes, smaller accelerations, another orientation"
        )
    say(f"Merging boxes for {robot.name}")
    lower, upper, merged = sets_of_cells(cells, cover, list(must.values()))
    covered = np.zeros(cells.inside.shape, bool)
    for low, high in merged.tolist():
        covered[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] = True
    about = {
        **draft.about,
        "proven_share": cells.share,
        "excluded_share": float(np.mean(cells.excluded)),
        "covered_share": float(np.count_nonzero(covered) / np.count_nonzero(cells.inside)),
        "raster": list(cells.inside.shape),
        "cells_cut_further": cut,
    }
    return replace(
        draft, lower=lower, upper=upper, axes=cells.axes, cells=cells, cut=cut, about=about
    )


def _about(
    robot: Robot, kinds: tuple[str, ...], angles: Array, obstacles: Array | Obstacles | None,
    box: Array | None, settings: ProofSettings,
) -> dict[str, Any]:  # fmt: skip
    there = obstacles if isinstance(obstacles, Obstacles) else Obstacles()
    if obstacles is not None and not isinstance(obstacles, Obstacles):
        there = Obstacles(np.asarray(obstacles, float))
    return {
        "robot": robot.name,
        "kinds": list(kinds),
        "angles_rad": [angles.min(axis=0).tolist(), angles.max(axis=0).tolist()],
        "obstacles": [
            {"name": one.name, "points_m": one.points.tolist(), "radius_m": one.radius}
            for one in there.shapes()
        ],
        "accelerations_m_s2": None if box is None else box.tolist(),
        "tension_limits_n": [float(v) for v in robot.tension_limits(settings.limits)],
        "clearance_m": settings.clearance,
        "cables": "over pulleys" if settings.pulleys else "from fixed exit points",
        "boxes_judged_at_most": settings.boxes,
    }
