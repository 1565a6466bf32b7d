"""A motion of a robot from one pose to another that is proven at every instant."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter

from cdpr_drake.analyses.frame.folder import results_folder
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Formats,
    InputFile,
    Limits,
    OutFolder,
    RobotWord,
    Switch,
    Word,
    numbers,
    one_of,
    value_of,
    with_word,
    words,
)
from cdpr_drake.analyses.planning.free_plan import Goal, Start
from cdpr_drake.analyses.planning.path_plan import StreamModel
from cdpr_drake.analyses.planning.plans import finished
from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    length_scale,
    path_task,
    pose_in_degrees,
    robot_limits,
)
from cdpr_drake.analyses.workspaces.workspace_files import load_all_obstacles
from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError, WorkspaceError
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_pose
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.path_timing import STATIONS
from cdpr_drake.proofs.motions_in_sets import MotionInSets, ProvenPlan, TimedPlan, judged
from cdpr_drake.proofs.path_in_sets import METHODS, proven_motion
from cdpr_drake.proofs.robot_sets import (
    BOXES,
    ProofSettings,
    ProvenSets,
    explain_pose,
    find_timed_sets,
)
from cdpr_drake.proofs.timed_motion import motion_in_time, straight_time
from cdpr_drake.proofs.timed_sets import TimedSets
from cdpr_drake.workspaces.cable_interference import Surroundings
from cdpr_drake.workspaces.moving_shapes import MovingObstacle

ACCELERATION = 0.25
"""Half width of the box of accelerations that is proven by default if nothing turns [m/s^2]."""


def accelerations_of(word: str) -> float | list[float]:
    """Half widths of a, ax,ay,az, or a,alpha, which gives (alpha, alpha, alpha, a, a, a)."""
    values = numbers(1, 2, 3)(word).tolist()
    if min(values) <= 0.0 and values != [0.0]:
        raise ValueError(word)
    if len(values) == 2:
        return [*[values[1]] * 3, *[values[0]] * 3]
    return values[0] if len(values) == 1 else list(values)


Accelerations = Annotated[
    Any, words(with_word(accelerations_of), "a or ax,ay,az or a,alpha, each above 0, or 0 [m/s^2, "
               "rad/s^2]", "A|AX,AY,AZ|A,ALPHA", name="--acceleration"),
]  # fmt: skip


@verb()
def plan_proven_motion(
    robot: RobotWord, start: Start, goal: Goal, *,
    least_time: Annotated[bool, Parameter(name="--time", negative=())] = False,
    clearance: float | None = None, obstacles: InputFile = None,
    moving: Annotated[Sequence[MovingObstacle], Parameter(parse=False)] = (),
    accelerations: Accelerations = None, boxes: int | None = None,
    method: Annotated[str | None, one_of(METHODS)] = None, stations: int = STATIONS,
    sets: Annotated[ProvenSets | None, Parameter(parse=False)] = None, limits: Limits = None,
    cable_speed: float | None = None, cable_acceleration: float | None = None,
    speed: float | None = None, reserve: float = RESERVE, pulleys: bool = True,
    track: bool | None = None, stream: float | None = None, stream_model: StreamModel = None,
    folder: OutFolder = None, overwrite: Switch = False, formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> MotionInSets:  # fmt: skip
    """Plans a motion from one pose to another in sets of poses that are proven.

    With accelerations, if it turns also angular ones, it is proven of every instant that tensions
    within the limits (less the reserve) give the motion, and that cables and platform meet nothing.
    Among obstacles that move the sets are of poses and time, and the motion waits where it must.

    Args:
        robot: Robot by name or file.
        start: Pose X_WP at the start [m, deg].
        goal: Pose X_WP at the end [m, deg].
        least_time: Least time instead of least length.
        clearance: Least distance of cables from each other, and of cables and platform from
            obstacles [m].
        obstacles: What stands in the way, YAML as of cdpr workspace --obstacles, which may also
            move, and be other robots with their plans; in Python also what `ProvenSets.find` takes.
        moving: Obstacles that move, in addition to those of a file.
        accelerations: The motion stays within accelerations a or ax,ay,az of Po, any of which the
            cables are proven to give; 0: poses only; default: 0.25, or 0 if the platform turns
            [m/s^2]. If it turns: a,alpha, of the centre of mass and about it, with gyroscopic terms
            [m/s^2, rad/s^2]. In Python half widths of the box: one, three, or six, (angular,
            linear).
        boxes: Largest number of boxes of poses that are judged.
        method: How sets are chosen: sequences, short ones from set to set, or gcs, by Drake's graph
            of convex sets, to compare; default: sequences.
        stations: Number of points of the path at which limits are checked.
        sets: Sets that were found before, instead of new ones.
        limits: Smallest and largest tension [N]; default: the robot's.
        cable_speed: Largest cable speed [m/s]; default: at the motors' rated speed.
        cable_acceleration: Largest cable acceleration [m/s^2]; default: no limit.
        speed: Largest speed of Po [m/s]; default: no limit.
        reserve: Share of every limit that is left for feedback.
        pulleys: Take the robot's pulleys into account.
        track: Also have the simulated robot track the plan at 1 kHz; default: if results are kept.
        stream: Also compute cable lengths and motor angles at so many points a second [Hz].
        stream_model: Cables of the stream: elastic or catenary; default: as the robot's sag.
        folder: Results folder; default: plans/ROBOT, or ROBOT-2, ...; in Python nothing is kept.
        overwrite: Replace earlier results in the folder.
        formats: Formats of the figures in the folder.
        follow: Who follows the work.

    Raises:
        PlanningError: The sets do not connect the poses, or an argument is not accepted.
        WorkspaceError: Something does not hold at an end, or is not proven there: which kind, and
            numbers.
        CdprError: A file cannot be read, or the robot is not accepted.
        OutputFolderError: The folder holds other results or files, or cannot be written.
    """
    if boxes is not None and boxes < 1:
        raise PlanningError(f"boxes: found {boxes}; accepted: at least 1")
    loaded = as_robot(robot, "plan_proven_motion")
    bounds = robot_limits(
        loaded, limits, cable_speed=cable_speed, cable_acceleration=cable_acceleration, speed=speed
    )
    task = path_task(loaded, bounds, loaded.cable_set(pulleys), reserve=reserve)
    X_ends = [as_pose(loaded, value_of(pose)) for pose in (start, goal)]
    ends = [np.concatenate([X.translation(), angles_from_rotation(X.rotation())]) for X in X_ends]
    box, cost = value_of(accelerations), "time" if least_time else "length"
    is_file = isinstance(obstacles, str | Path)
    resting = obstacles
    if is_file:
        resting, more = load_all_obstacles(Path(obstacles))
        moving = (*more, *moving)
    no_box = box is not None and np.ndim(box) == 0 and box == 0.0
    turns = not np.array_equal(ends[0][3:], ends[1][3:])
    if moving:
        _check_among_moving(method, no_box, turns)
    arguments = {
        "limits_n": limits, "cable_speed_m_s": cable_speed,
        "cable_acceleration_m_s2": cable_acceleration, "speed_m_s": speed, "reserve": reserve,
        "pulleys": pulleys,
        "from": start if isinstance(start, Word) else pose_in_degrees(X_ends[0]),
        "to": goal if isinstance(goal, Word) else pose_in_degrees(X_ends[1]),
        "least": cost, "time": least_time, "clearance": clearance, "boxes": boxes,
        "method": method, "stations": stations, "obstacles": str(obstacles) if is_file else None,
        "acceleration": accelerations if isinstance(accelerations, Word) else None,
    }  # fmt: skip
    if box is not None:
        arguments["accelerations"] = box.tolist() if isinstance(box, np.ndarray) else box
    name = f"plans/{loaded.name}"
    with results_folder(name, arguments, folder, overwrite, follow.results) as results:
        follow.doing(f"Planning for {loaded.name}")
        begin = time.perf_counter()
        if sets is None:
            if box is None and not turns:
                box = ACCELERATION
            elif no_box:
                box = None
            proof = ProofSettings(
                boxes=BOXES if boxes is None else boxes, clearance=clearance or 0.0,
                limits=(task.limits.lower, task.limits.upper), pulleys=pulleys,
            )  # fmt: skip
            sets = ProvenSets.find(
                loaded, None, np.array([end[3:] for end in ends]), resting, box,
                must=dict(zip(("from", "to"), ends, strict=True)), settings=proof,
                say=follow.doing,
            )  # fmt: skip
        else:
            _check_ends(sets, ends)
        between = time.perf_counter()
        plan: MotionInSets
        if moving:
            around, timed, rates = _sets_among_moving(loaded, sets, moving, ends, task, follow)
            between = time.perf_counter()
            in_time = motion_in_time(
                timed, ends[0], ends[1], task, rates, cost=cost, say=follow.doing
            )
            took = time.perf_counter() - between
            plan = TimedPlan(
                robot=loaded, limits=bounds, arguments=arguments, planning_time=took,
                solution=in_time.plan, in_sets=in_time, things=tuple(moving), around=around,
                sets_time=between - begin, judged=judged(sets, in_time.plan, moving),
            )  # fmt: skip
        else:
            try:
                in_sets = proven_motion(
                    sets, ends[0], ends[1], task, length_scale(loaded), cost=cost,
                    method=method or METHODS[0], stations=stations, say=follow.doing,
                )  # fmt: skip
            except PlanningError as problem:
                if not sets.cut or "do not connect" not in str(problem):
                    raise
                raise PlanningError(
                    f"{problem}; {sets.cut} open cells between them were cut further"
                ) from problem
            plan = ProvenPlan(
                robot=loaded, limits=bounds, arguments=arguments, solution=in_sets.plan,
                planning_time=time.perf_counter() - between, in_sets=in_sets,
                sets_time=between - begin, judged=judged(sets, in_sets.plan),
            )  # fmt: skip
        return finished(
            plan, results, track=track, stream=stream, stream_model=stream_model, formats=formats,
            follow=follow,
        )  # fmt: skip


def _check_among_moving(method: str | None, no_box: bool, turns: bool) -> None:
    if method not in (None, METHODS[0]):
        raise PlanningError(
            f"method: found {method!r} with obstacles that move; accepted: {METHODS[0]}"
        )
    if turns:
        raise PlanningError(
            "from, to: found two orientations with obstacles that move; accepted: one"
        )
    if no_box:
        raise PlanningError(
            "accelerations: found 0 with obstacles that move; accepted: above 0, since when it is "
            "where depends on them"
        )


def _check_ends(sets: ProvenSets, ends: Sequence[Array]) -> None:
    for where, pose in zip(("from", "to"), ends, strict=True):
        if not sets.covers(pose):
            why = explain_pose(sets, pose) if sets.conditions is not None else ""
            raise WorkspaceError(
                f"{where}: lies in none of {len(sets)} sets{': ' * bool(why)}{why}; accepted: a "
                "pose in one of them"
            )


def _sets_among_moving(
    robot: Robot, sets: ProvenSets, things: Sequence[MovingObstacle], ends: Sequence[Array],
    task: PathTask, follow: Follow,
) -> tuple[Surroundings, TimedSets, Array]:  # fmt: skip
    """Cables and platform, sets of poses and time, and the box of accelerations [m/s^2]."""
    if sets.about["accelerations_m_s2"] is None or sets.conditions is None:
        raise PlanningError(
            "sets: found sets of a file, or without accelerations, with obstacles that move; "
            "accepted: sets that were found with accelerations"
        )
    box = np.array(sets.about["accelerations_m_s2"], float)
    whole = straight_time(task, ends[0], ends[1], box)
    timed = find_timed_sets(
        robot, sets, things, (ends[0], ends[1]), whole, clearance=float(sets.about["clearance_m"]),
        say=follow.doing,
    )  # fmt: skip
    assert sets.conditions.around is not None
    return sets.conditions.around, timed, box
