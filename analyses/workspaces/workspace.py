"""Where a robot can work: the verb `compute_workspace`."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import numpy as np
from cyclopts import Parameter

from cdpr_drake.analyses.frame.folder import results_folder
from cdpr_drake.analyses.frame.follow import NOBODY, Follow, Progress
from cdpr_drake.analyses.frame.jobs import finished_jobs
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Box,
    Formats,
    InputFile,
    Limits,
    OutFolder,
    RobotWord,
    ScenarioWord,
    Vector,
    Workers,
    Wrench,
    names,
    numbers,
    one_of,
    words,
)
from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.analyses.reporting.written_files import whole_file
from cdpr_drake.analyses.runs.breaks import SAVING
from cdpr_drake.analyses.workspaces.conditions import (
    KINDS,
    MEASURES,
    OF_BREAKS,
    RULES,
    SURVIVES,
    PoseConditions,
    conditions_at,
)
from cdpr_drake.analyses.workspaces.grid_runs import POSES, Chunks, reused
from cdpr_drake.analyses.workspaces.pose_grid import (
    Grid,
    Orientations,
    grid_arguments,
    make_grid,
    plain,
)
from cdpr_drake.analyses.workspaces.robot_conditions import grid_conditions, interference_bodies
from cdpr_drake.analyses.workspaces.servo_stability import STRAIGHT
from cdpr_drake.analyses.workspaces.workspace_files import load_obstacles, load_wrench_set
from cdpr_drake.analyses.workspaces.workspace_hulls import hull_bound, robot_hull
from cdpr_drake.analyses.workspaces.workspace_result import Workspace, load_workspace
from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.tensions.methods import METHODS
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.mesh_files import GRID_ENDINGS, MESH_ENDINGS, mesh_ending, write_hull
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid

CHUNKS = {"target-visible": 256, "stable": 256, SURVIVES: 1}
"""Poses of a chunk with slow kinds: seconds of work."""

CHUNK = 4096
"""Poses of a chunk with the others: a tenth of a second of work."""

PROOFS = "cdpr_drake.proofs.certified_workspace"
"""Module that proves boxes of poses, for `certify`."""


def corners(word: str) -> Array:
    """Corners x,y,z of a way, with ; between, shape (n, 3)."""
    return np.array([numbers(3)(corner) for corner in word.split(";")])


def _names(known: Collection[str], name: str | None, metavar: str) -> Parameter:
    return words(
        names, "names with commas", f"{metavar},...", name=name, completer=lambda _: list(known)
    )


Kinds: TypeAlias = Annotated[str | Sequence[str], _names(KINDS, "--kind", "KIND")]
Measures: TypeAlias = Annotated[str | Sequence[str], _names(MEASURES, "--measure", "MEASURE")]
Reactions: TypeAlias = Annotated[Sequence[str] | None, _names(SAVING, None, "REACTION")]
WrenchSet: TypeAlias = Annotated[
    Path | str | SpatialSet | None, words(Path, "a file", "FILE", name="--wrench-set")
]
Accelerations: TypeAlias = Annotated[
    Sequence[float] | Array | SpatialSet | None,
    words(numbers(1, 2), "a or a,alpha, each >= 0 [m/s^2, rad/s^2]", "A[,ALPHA]",
          name="--acceleration"),
]  # fmt: skip
Velocities: TypeAlias = Annotated[
    Sequence[Any] | Array | None,
    words(numbers(3), "wx,wy,wz [rad/s]", "WX,WY,WZ", name="--velocity", many=True),
]
Way: TypeAlias = Annotated[
    Sequence[Sequence[float]] | Array | None,
    words(corners, "corners x,y,z [m], with ; between", "X,Y,Z;..."),
]


@verb()
def compute_workspace(
    robot: RobotWord, kinds: Kinds = "static", grid: Grid = None, *,
    measures: Measures = (), orientation: Orientations = (),
    orientations: Annotated[str, one_of(RULES)] = "all", required: WrenchSet = None,
    force: float | None = None, moment: float | None = None, accelerations: Accelerations = None,
    velocities: Velocities = None, clearance: float = 0.0, obstacles: InputFile = None,
    anchor_free: float | None = None, exit_free: float | None = None,
    scenario: ScenarioWord = None, hull: Vector = None, box: Box = None, unbounded: bool = False,
    pulleys: bool = True, method: Annotated[str | None, one_of(METHODS)] = None,
    reactions: Reactions = None, moving: Vector = None, after: float = 2.0, rays: int = 10_000,
    tolerance: float = 1e-3, mesh: Path | None = None, certify: bool = False,
    boxes: int = 200_000, boxes_mesh: Path | None = None, refine: Way = None,
    refine_reach: float = 0.05, refine_boxes: int = 100_000, exit_error: float = 0.0,
    anchor_error: float = 0.0, limits: Limits = None, mass: float | None = None,
    wrench: Wrench = None, folder: OutFolder = None, overwrite: bool = False,
    workers: Workers = None, formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Workspace:  # fmt: skip
    """Finds where a robot can work: kinds of workspaces, their intersection, and measures.

    The same call goes on in its folder after a stop, and reuses the grid if only hull or boxes are
    new.

    Args:
        robot: Robot by name or file.
        kinds: One or several of static, wrench-feasible, dynamic, wrench-closure, single-failure,
            statically-stable, singularity-free, interference-free, collision-free, target-visible,
            dynamic-single-failure, stable.
        grid: x,y,z, each a number of points in the default box, or lower:upper:step [m]; in Python
            also a WorkspaceGrid. Default: the robot's grid.
        measures: One or several of capacity-margin, breaks-survived, failure-margin,
            break-excursion, worst-cable, best-reaction, tension-factor, payload, stiffness,
            frequency, dexterity, clearance. A negative capacity-margin says how far outside a pose
            is.
        orientation: Angles phi,theta,psi of the platform, each a number or lower:upper:step [deg];
            may be repeated. Default: unturned.
        orientations: Orientations in which a kind must hold: all (inclusion workspace) or any
            (maximal workspace).
        required: YAML file of the wrenches to resist: vertices, box, ellipsoid; in Python also a
            SpatialSet.
        force: Largest force to resist along each axis [N].
        moment: Largest moment to resist about each axis [N m].
        accelerations: Largest accelerations to give along and about each axis [m/s^2, rad/s^2]; in
            Python also a SpatialSet.
        velocities: Angular velocity of the platform at which to give them [rad/s]; may be
            repeated; in Python also rows of six (angular, linear). Default: at rest.
        clearance: Least distance of cables and platform from everything else [m].
        obstacles: YAML file of what stands in the frame: boxes, spheres, capsules, meshes; in
            Python also Obstacles, or rows of boxes.
        anchor_free: Length of cables next to anchor points that is not compared with the platform
            [m].
        exit_free: Length of cables next to exit points that is not compared with the frame [m].
        scenario: Scenario whose camera and target count; for dynamic-single-failure its cables,
            winches and torque_control.
        hull: Also compute the hull seen from x,y,z [m], by rays that end at the frame at the
            latest; a frame that was assumed at import does not end them.
        box: Box [m] instead of the frame: where the hull ends, and the default grid and the
            certified boxes lie.
        unbounded: Let nothing bound the hull.
        pulleys: Take the robot's pulleys into account; without them cables run from fixed exit
            points.
        method: For static: tension distribution method that must hold the weight; default: any
            tensions.
        reactions: For dynamic-single-failure: one or several of stop, redistribute, brake, retreat,
            descend; default: all but descend.
        moving: For dynamic-single-failure: velocity of the platform when a cable breaks [m/s];
            default: at rest.
        after: For dynamic-single-failure: time simulated after a break [s].
        rays: Largest number of rays of the hull.
        tolerance: Distance from the border within which rays of the hull end [m].
        mesh: File for the hull's triangles: .glb, .obj, .ply, .stl, .vtk, .vtu.
        certify: Also prove boxes of poses to be inside or outside all kinds.
        boxes: Largest number of boxes to judge.
        boxes_mesh: File for the boxes as cells of VTK: .vtk, .vtu.
        refine: With certify: corners of a way of Po [m] about which open boxes are cut further.
        refine_reach: With refine: largest distance of Po from the way along each axis [m].
        refine_boxes: With refine: largest number of boxes to judge for it.
        exit_error: With certify: error of exit points up to which the proof holds [m].
        anchor_error: With certify: error of anchor points up to which the proof holds [m].
        limits: Smallest and largest tension [N]; default: the robot's.
        mass: Mass of the platform [kg]; default: the robot's.
        wrench: Wrench on the platform about Po in W, beside its weight, moments first [N m, N].
        folder: Results folder; default on the command line: one named by the arguments.
        overwrite: Replace other results in the folder.
        workers: Processes, or a Dask scheduler; default: one process for each processor, for long
            work.
        formats: Formats of the figures' files.
        follow: Who follows.

    Raises:
        StoppedError: It was stopped before the grid was finished.
        CdprError: Something is unknown, missing, out of range, or not possible for the robot.
        OutputFolderError: The folder holds other results or files, or cannot be written.

    Source: Gazebo thesis 2.6; servoing thesis 1.2.2, 1.3.3.
    """
    loaded, kinds, measures = as_robot(robot, "compute_workspace"), _each(kinds), _each(measures)
    _check_names(kinds=(kinds, KINDS), measures=(measures, MEASURES),
                 orientations=([orientations], RULES))  # fmt: skip
    _check_hull(hull, rays, mesh, unbounded, box)
    _check_boxes(certify, boxes, boxes_mesh, orientations, refine, refine_reach, refine_boxes)
    poses = make_grid(loaded, robot, grid, orientation, box)
    region = None if box is None else (np.asarray(box[0], float), np.asarray(box[1], float))
    if {*kinds, *measures} & {SURVIVES, *OF_BREAKS}:
        measures = tuple(dict.fromkeys([*measures, *OF_BREAKS]))
    if mass is not None and not (math.isfinite(mass) and mass > 0.0):
        raise WorkspaceError(f"mass: found {mass:g}; accepted: > 0 [kg]")
    if isinstance(obstacles, str | Path):
        obstacles = load_obstacles(Path(obstacles))
    about = grid_conditions(
        robot, kinds, measures, poses, scenario, reactions, moving, after, limits=limits,
        mass=mass, wrench=None if wrench is None else np.asarray(wrench, float),
        required=_required(required, force, moment), accelerations=_accelerations(accelerations),
        velocities=_velocities(velocities), clearance=clearance, pulleys=pulleys, method=method,
        around=interference_bodies(loaded, obstacles, exit_free, anchor_free, pulleys),
    )  # fmt: skip
    if certify:
        proofs, errors = import_module(PROOFS), (exit_error, anchor_error)
        search = proofs.box_search(loaded, about, kinds, poses.angles, errors, region)
    arguments = _arguments(loaded, about, poses, {
        "kinds": kinds, "measures": measures, "orientations": orientations, "method": method,
        "scenario": scenario or "",
    })  # fmt: skip
    title = f"{loaded.name}-{kinds[0] if len(kinds) == 1 else f'{len(kinds)}-kinds'}"
    with results_folder(title, arguments, folder, overwrite, follow.results, grows=True) as results:
        ends = cast = None
        if hull is not None:
            follow.progress(Progress("casting rays", 0.0, rays, unit="rays"))
            ends = hull_bound(loaded, region, unbounded)
            cast = robot_hull(
                loaded, about, kinds, hull, ends, angles=poses.angles, rule=orientations,
                rays=rays, tolerance=tolerance,
            )  # fmt: skip
        if results is not None and reused(results, follow):
            result = load_workspace(results.path)
        else:
            chunk = min((CHUNKS[kind] for kind in kinds if kind in CHUNKS), default=CHUNK)
            chunk = CHUNKS[SURVIVES] if about.breaks is not None else chunk
            work = partial(conditions_at, about, poses, (*kinds, *measures))
            chunks = Chunks(poses.size, chunk, results, follow)
            for job in finished_jobs(
                work, chunks.missing, workers, stop=follow.stop, say=follow.say, name=POSES
            ):
                chunks.add(job)
            shaped = {name: array.reshape(poses.shape) for name, array in chunks.arrays().items()}
            result = Workspace(
                arguments=arguments, grid=poses, holds={name: shaped[name] for name in kinds},
                values={name: shaped[name] for name in measures},
            )  # fmt: skip
            if results is not None:
                result.save(results)
        result = replace(result, robot=loaded, hull=cast, bound=ends, region=region)
        if mesh is not None and cast is not None:
            with whole_file(Path(mesh)) as part:
                write_hull(cast, part)
        if certify:
            way = None if refine is None else np.asarray(refine, float)
            result = proofs.certified(
                result, search, boxes, boxes_mesh and Path(boxes_mesh), way, refine_reach,
                refine_boxes, results, follow,
            )  # fmt: skip
        return result.written(results, formats, follow)


def _each(words: str | Sequence[str]) -> tuple[str, ...]:
    """Names, each once."""
    return tuple(dict.fromkeys(names(words) if isinstance(words, str) else words))


def _check_names(**arguments: tuple[Sequence[str], Mapping[str, Any]]) -> None:
    for argument, (values, table) in arguments.items():
        for name in values:
            if name not in table:
                raise WorkspaceError(f"{argument} {name!r} is unknown; {closest(name, table)}")
    if not arguments["kinds"][0]:
        raise WorkspaceError(f"kinds: found none; accepted: {', '.join(KINDS)}")


def _check_hull(hull: Any, rays: int, mesh: Path | None, unbounded: bool, box: Any) -> None:
    if unbounded and (hull is None or box is not None):
        wrong = "needs hull" if hull is None else "found box"
        raise WorkspaceError(f"unbounded: {wrong}; accepted: with hull and without box")
    if hull is not None and np.shape(hull) != (3,):
        raise WorkspaceError(f"hull: found {hull!r}; accepted: x, y, z [m]")
    if rays < 1:
        raise WorkspaceError(f"rays: found {rays}; accepted: at least 1")
    if mesh is not None and hull is None:
        raise WorkspaceError("mesh: needs hull; accepted: both")
    if mesh is not None:
        mesh_ending(Path(mesh), MESH_ENDINGS)


def _check_boxes(
    certify: bool, boxes: int, mesh: Path | None, rule: str, refine: Any, reach: float, more: int
) -> None:
    for name, value in {"boxes_mesh": mesh, "refine": refine}.items():
        if value is not None and not certify:
            raise WorkspaceError(f"{name}: needs certify; accepted: both")
    for name, count in {"boxes": boxes, "refine_boxes": more}.items():
        if count < 1:
            raise WorkspaceError(f"{name}: found {count}; accepted: at least 1")
    if mesh is not None:
        mesh_ending(Path(mesh), GRID_ENDINGS)
    if certify and rule != "all":
        raise WorkspaceError(f"certify: found orientations {rule}; accepted: all")
    way = np.zeros((1, 3)) if refine is None else np.asarray(refine, float)
    if way.ndim != 2 or way.shape[1] != 3 or not len(way) or not np.all(np.isfinite(way)):
        raise WorkspaceError(
            f"refine: found shape {way.shape}; accepted: corners x, y, z, at least one [m]"
        )
    if not (np.isfinite(reach) and reach >= 0.0):
        raise WorkspaceError(f"refine_reach: found {reach:g} m; accepted: at least 0")


def _required(
    required: SpatialSet | Path | str | None, force: float | None, moment: float | None
) -> SpatialSet | None:
    """Wrenches to resist: a set, its file, or up to a force [N] and a moment [N m] along axes."""
    if force is None and moment is None:
        return load_wrench_set(Path(required)) if isinstance(required, str | Path) else required
    if required is not None:
        raise WorkspaceError("required: found force or moment too; accepted: one way")
    for name, value in (("force", force), ("moment", moment)):
        if value is not None and not (math.isfinite(value) and value >= 0.0):
            raise WorkspaceError(f"{name}: found {value:g}; accepted: a finite number >= 0")
    return SpatialSet(box=np.repeat([moment or 0.0, force or 0.0], 3))


def _accelerations(values: Any) -> SpatialSet | None:
    """The box of the largest accelerations along and about each axis."""
    if values is None or isinstance(values, SpatialSet):
        return values
    largest = np.asarray(values, float)
    if largest.shape not in ((1,), (2,)) or not np.all(largest >= 0.0):
        raise WorkspaceError(
            f"accelerations: found {values}; accepted: a or a,alpha, each >= 0 [m/s^2, rad/s^2]"
        )
    linear, angular = (*largest, 0.0)[:2]
    return SpatialSet(box=np.repeat([angular, linear], 3))


def _velocities(values: Any) -> Array | None:
    """Velocities (angular, linear), shape (k, 6) [rad/s, m/s]."""
    if values is None or len(values) == 0:
        return None
    rows = np.asarray(values, float)
    return np.hstack([rows, np.zeros_like(rows)]) if rows.shape[-1] == 3 else rows


def _arguments(
    robot: Robot, about: PoseConditions, grid: WorkspaceGrid, names: Mapping[str, Any]
) -> dict[str, Any]:
    """All that the arrays depend on, for JSON; equal arguments give equal arrays."""
    over, view, stable = about.case.cables.has_pulleys(), about.view, about.stable
    cables = "over pulleys" + ", but for the kind stable: from fixed exit points" * bool(stable)
    if not robot.cable_set().has_pulleys():
        cables = "from fixed exit points, as the robot has no pulleys"
    elif not over:
        cables = "without pulleys: from fixed exit points"
    geometry = robot.geometry_words(over)
    if about.breaks is not None:
        simulated = robot.geometry_words(about.breaks.request.scenario.cables.pulleys)
        geometry += "" if simulated == geometry else f"; simulated breaks: {simulated}"
    geometry += f"; {STRAIGHT}" if stable and over else ""
    result: dict[str, Any] = plain({
        "cables": cables, "geometry": geometry, "cdpr_drake": code_version(), "robot": robot.name,
        **names, "grid": grid_arguments(grid), "statics": about.case,
        "elasticity_n": about.case.cables.stiffness, "body": about.body, "gravity": about.gravity,
        "clearance_m": about.clearance, "surroundings": about.around, "required": about.required,
        "motion": about.motion, "view": view and {"X_WO": view.X_WO, "X_PC": view.X_PC},
        "stable": stable and {
            "case": stable.case, "bounds": stable.bounds.as_dict(), "verdict": stable.verdict,
        },
    })  # fmt: skip
    return result if about.breaks is None else result | {"breaks": about.breaks.arguments()}
