"""Study: closed loops from many poses of a stability workspace: is the criterion's promise kept?

Loops of every scheme start on ACROBOT at poses of its searched workspace, under perturbations of
full size, by kinematics alone and on the simulated robot.

Source: servoing thesis 3.3, 3.4; 5.1, 5.2.1.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import product
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.figures import line_style, new_figure
from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.studies.perturbed_servo import (
    Perturbation,
    PerturbedServo,
    ServoCase,
    perturbed_scenario,
    perturbed_servo,
    servo_case,
)
from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study
from cdpr_drake.analyses.workspaces.robot_conditions import static_case
from cdpr_drake.arrays import Array
from cdpr_drake.errors import StabilityError
from cdpr_drake.geometry.poses import (
    exponential,
    pose_error,
    pose_from_angles,
    pose_from_row,
    pose_row,
    pose_rows_distance,
)
from cdpr_drake.palette import OTHER_OUTCOME, OUTCOMES, Look
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.stability_case import SCHEMES
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability, worst_perturbations
from cdpr_drake.systems.cameras.camera_settings import servo_pinhole
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.workspaces.static_feasibility import statically_feasible

ROBOT = "acrobot_large"
CABLES = 8
VERDICT = "searched"
SEED = 1
OPTIONS = VerdictOptions(seed=SEED)

SETTINGS = (
    f"robot={ROBOT}",
    "camera.kind=projected",
    "camera.pixel_noise=0",
    "target.pose.position=[0, 0, 0]",
    "desired.position=[0, 0, 0.3]",
    "duration=60",
)
"""What differs from the scenario acrobot_pbvs: the tag lies in the middle of the floor, so that it
is seen from much of the workspace, and images have no noise, so that perturbations are all."""

MODES = {
    "kinematic": "what the criterion is about: kinematics, estimate off by a constant error",
    "shifted": "simulated robot, estimate off by a constant error",
    "control_integration": "simulated robot, estimate by control integration from a wrong start",
    "kinematic, worst": "as kinematic, with the worst perturbation that a search finds",
    "shifted, worst": "as shifted, with the worst perturbation that a search finds",
    "shifted, worst, managed": "as shifted, worst, with tension management",
}
"""How the loop is closed, kinematics alone or the simulated robot with an estimator, and under what
perturbation; elsewhere its directions are random."""

PLAIN, MANAGED = "shifted, worst", "shifted, worst, managed"

MANAGEMENT = "tension_management={kind: constant, threshold: [1.0], gain: 0.003}"
"""What the managed loops add; the gain is for cables as stiff as their fibre, for which the
published one is too high."""

STARTS, QUICK_STARTS = 200, 2

LEAST_DRAWN_SHARE = 1e-4
"""Smaller errors are not drawn."""

THIN = {"linewidth": 0.6, "alpha": 0.6}
"""Style of one of many curves."""

LOWEST = 0.15
"""Starts keep this height, so that the tag is in front of the camera [m]."""

TILT_DEG, YAW_DEG = 15.0, 45.0
"""Starts are turned by angles phi, theta and psi up to these [deg]."""

CANDIDATES = 64
"""Poses that are drawn at a time."""

PATH_POSES, CURVE = 10, 80
"""Poses of a path that are judged, both ends among them, and samples of |e| that are kept."""

STEP, LONGEST_TIME = 0.02, 100.0
"""Step of the kinematic loop, and when it ends without convergence, times the gain [-]."""

REACHED = 1e-3
"""The kinematic loop has converged when the error is this share of what it was."""


@cache
def loop_scenario(scheme: str, managed: bool = False) -> Scenario:
    """The servo's task; starts and perturbations are put in."""
    settings = [*SETTINGS, f"controller.scheme={scheme}", *([MANAGEMENT] if managed else [])]
    return load_scenario("acrobot_pbvs", settings)


@cache
def loop_case(scheme: str) -> ServoCase:
    """The servo without perturbation, and the same for verdicts."""
    return servo_case(loop_scenario(scheme), LOWEST)


@dataclass(frozen=True, eq=False)
class KinematicPath:
    """What the kinematic loop did.

    Attributes:
        poses: X_WP at each step.
        errors: |e| at each step (of ibvs: |L^+ e|), shape (n,) [rad, m].
        outcome: CONVERGED, TARGET_LOST when it left the image, DIVERGED when the platform left the
            frame, or TIMEOUT.
    """

    poses: list[RigidTransform]
    errors: Array
    outcome: Outcome


def kinematic_path(servo: PerturbedServo, X_WP: RigidTransform) -> KinematicPath:
    """Runs de/dt = -Pi e from a pose [m], with unit gain, until it converges or fails.

    The loop is that of the stability criterion, without masses and slack. The servo asks for cable
    velocities by what it believes, with an estimate that is always off by the perturbation; the
    platform moves as the true cables' least squares have it.

    Source: servoing thesis (1.40).
    """
    pinhole = servo_pinhole(servo.scenario.camera, servo.robot)
    lower, upper = servo.robot.frame.bounds()
    local = servo.scenario.controller.scheme == "ibvs"
    poses, errors, outcome = list[RigidTransform](), list[float](), Outcome.TIMEOUT
    for _ in range(round(LONGEST_TIME / STEP)):
        if not servo.target.in_view(servo.X_CO(X_WP), pinhole):
            outcome = Outcome.TARGET_LOST
            break
        p = X_WP.translation()
        if np.any(p < lower) or np.any(p > upper):
            outcome = Outcome.DIVERGED
            break
        e, L = servo.error(X_WP)
        motion = np.linalg.pinv(L) @ e
        poses.append(X_WP)
        errors.append(float(np.linalg.norm(motion if local else e)))
        if errors[-1] <= REACHED * errors[0]:
            outcome = Outcome.CONVERGED
            break
        truth, estimate = servo.models(X_WP)
        rates = -estimate.camera_jacobian() @ motion
        V_C = np.linalg.pinv(truth.camera_jacobian()) @ rates
        X_WP = X_WP @ servo.X_PC @ exponential(STEP * V_C) @ servo.X_PC.inverse()
    return KinematicPath(poses, np.array(errors), outcome)


def seen_errors(result: ServoRun) -> Array:
    """|e| of the features at the control steps at which the target was seen, shape (n,)."""
    errors = np.linalg.norm(result.log["error"], axis=1)
    # The servo's first output comes after its first image; a lost target leaves the last error.
    seen = errors[(errors > 0.0) & (result.log["gain"][:, 0] > 0.0)]
    return seen if len(seen) else np.zeros(1)


def perturbation_of(scheme: str, start: Array, *, worst: bool) -> Perturbation:
    """The perturbation of a start: random, as large as the bounds allow, or the worst one.

    Args:
        scheme: Visual servoing scheme.
        start: As `pose_row`.
        worst: True for the worst that a search finds at the start; else its directions are random.
    """
    setup = loop_case(scheme)
    if worst:
        _, drawn = worst_perturbations(setup.case, setup.bounds, start[None], OPTIONS)
    else:
        drawn = draw_perturbations(start, setup.bounds, setup.case.m, 1, SEED)
    return Perturbation.from_vector(drawn[0])


def closed_loop(scheme: str, mode: str, start_pose: Sequence[float]) -> dict[str, Any]:
    """Closes a loop from a pose: does the servo converge?

    Args:
        scheme: Visual servoing scheme.
        mode: One of `MODES`.
        start_pose: As `pose_row`.

    Returns:
        outcome; time_s (kinematic: times the gain); position_error_m, rotation_error_rad: true
        errors at the end; error_growth: largest rise of |e| between two samples, as a share of its
        start; least_margin of Pi for the run's own perturbation on its path; poses_checked of the
        path, and of these poses_outside_z; estimate_error_m, estimate_error_rad: largest errors of
        the pose estimate; taut_at_end: cables that pull then (kinematic: all of them); error_peak:
        largest |e| over |e| at the start; start_pose; curve: |e|, shape (CURVE,); way: the path,
        shape (PATH_POSES, 7).
    """
    setup, start = loop_case(scheme), np.array(start_pose)
    perturbation = perturbation_of(scheme, start, worst="worst" in mode)
    scenario = loop_scenario(scheme, mode == MANAGED)
    servo, X_WP = perturbed_servo(scenario, perturbation), pose_from_row(start)
    loop = mode.partition(",")[0]
    if loop == "kinematic":
        path = kinematic_path(servo, X_WP)
        rows = np.array([pose_row(X) for X in path.poses])
        believed = np.array([pose_row(perturbation.platform(X)) for X in path.poses])
        outcome, errors, time = path.outcome, path.errors, STEP * len(rows)
        taut = setup.case.m
    else:
        made = perturbed_scenario(scenario, X_WP, perturbation)
        made.estimator.kind = loop
        made.sensors.tracker = "ideal"
        result = ServoRun(choose_compiled_loop(made)).simulate()
        rows, believed = result.log["X_WP"], result.log["X_WP_estimated"]
        outcome, errors, time = Outcome(result.outcome), seen_errors(result), result.sim_time
        taut = int(np.sum(result.log["slack"][-1] == 0.0))
    way = np.linspace(0, len(rows) - 1, PATH_POSES).round().astype(int)
    judged = judge_stability(setup.case, setup.bounds, rows[way], VERDICT, OPTIONS)
    margins = [servo.margin(pose_from_row(rows[k]), pose_from_row(believed[k])) for k in way]
    final = pose_error(servo.X_CO(pose_from_row(rows[-1])), scenario.desired.transform())
    off, turned = pose_rows_distance(rows, believed)
    first = max(float(errors[0]), 1e-12)
    samples = np.linspace(0, len(errors) - 1, CURVE).round().astype(int)
    return {
        "outcome": outcome.name.lower(), "time_s": time,
        "position_error_m": final[0], "rotation_error_rad": final[1],
        "error_growth": float(np.max(np.diff(errors), initial=0.0)) / first,
        "least_margin": min(margins),
        "poses_checked": PATH_POSES, "poses_outside_z": int(np.sum(~judged.stable)),
        "estimate_error_m": np.max(off), "estimate_error_rad": np.max(turned),
        "taut_at_end": taut, "error_peak": float(np.max(errors)) / first,
        "start_pose": start.tolist(), "curve": errors[samples], "way": rows[way],
    }  # fmt: skip


@cache
def stable_starts(scheme: str, count: int) -> tuple[Array, dict[str, int]]:
    """Random poses of SZ from which the target is seen, position and angles evenly distributed.

    Args:
        scheme: Visual servoing scheme.
        count: How many poses; the first are the same for any count.

    Returns:
        Poses as rows, see `pose_row`, shape (n, 7) [-, m], and how many were drawn for them; of
        these, how many tensions within the bounds do not hold; of the rest, from how many the
        target is not in the image; of the rest, how many the verdict does not find stable.

    Raises:
        StabilityError: The desired pose is not stable, or cannot be held.
    """
    setup = loop_case(scheme)
    servo, statics = setup.servo, static_case(setup.servo.robot, pulleys=False)
    pinhole = servo_pinhole(servo.scenario.camera, servo.robot)

    def held(poses: Sequence[RigidTransform]) -> np.ndarray:
        places = np.array([X.translation() for X in poses])
        turns = np.array([X.rotation().matrix() for X in poses])
        return statically_feasible(statics, places, turns)

    def stable(poses: Sequence[RigidTransform]) -> np.ndarray:
        rows = np.array([pose_row(X) for X in poses]).reshape(-1, 7)
        if not len(rows):
            return np.zeros(0, bool)
        return judge_stability(setup.case, setup.bounds, rows, VERDICT, OPTIONS).stable

    goal = [servo.X_WO @ servo.scenario.desired.transform().inverse() @ servo.X_PC.inverse()]
    if not (held(goal)[0] and stable(goal)[0]):
        raise StabilityError("closed loop: the desired pose is not stable, or cannot be held")
    random = np.random.default_rng([SEED, 7])
    widest = np.radians([TILT_DEG, TILT_DEG, YAW_DEG])
    rows, counts = list[Array](), Counter[str]()
    while len(rows) < count:
        positions = random.uniform(*setup.box, (CANDIDATES, 3))
        angles = random.uniform(-widest, widest, (CANDIDATES, 3))
        poses = [pose_from_angles(p, a) for p, a in zip(positions, angles, strict=True)]
        holds = held(poses)
        seen = np.array([servo.target.in_view(servo.X_CO(X), pinhole) for X in poses])
        candidates = [poses[k] for k in np.flatnonzero(holds & seen)]
        good = stable(candidates)
        rows += [pose_row(X) for X, one in zip(candidates, good, strict=True) if one]
        counts.update(
            drawn=CANDIDATES, not_held=int(np.sum(~holds)), not_seen=int(np.sum(holds & ~seen)),
            not_stable=int(np.sum(~good)),
        )  # fmt: skip
    return np.array(rows[:count]), dict(counts)


def cases(form: Form) -> Iterator[Case]:
    """Every scheme in every mode from the same starts; their number is the seed."""
    for scheme, mode in product(SCHEMES, MODES):
        starts, _ = stable_starts(scheme, form.times(STARTS, QUICK_STARTS))
        for seed, start in enumerate(starts.tolist()):
            yield Case(
                keys={"scheme": scheme, "mode": mode, "seed": seed},
                call=partial(closed_loop, scheme, mode, start),
            )


def parameters(form: Form) -> Mapping[str, Any]:
    """What all loops have in common, and by scheme what its loops have."""
    return {
        "robot": ROBOT, "verdict": VERDICT, "options": OPTIONS, "seed": SEED, "modes": MODES,
        "settings": SETTINGS, "management": MANAGEMENT,
        "schemes": {scheme: _parameters(scheme, form) for scheme in SCHEMES},
    }  # fmt: skip


def _parameters(scheme: str, form: Form) -> dict[str, Any]:
    starts, counts = stable_starts(scheme, form.times(STARTS, QUICK_STARTS))
    scenario, setup = loop_scenario(scheme), loop_case(scheme)
    return {
        "bounds": setup.bounds.as_dict(), "scenario": scenario, "case": setup.case,
        "loop": choose_compiled_loop(scenario).integration.loop,
        "starts": {
            "count": len(starts), **counts,
            "largest_tilt_deg": TILT_DEG, "largest_yaw_deg": YAW_DEG,
        },
    }  # fmt: skip


def loop_counts(rows: Frame) -> dict[str, Any]:
    """Counts and extremes of loops."""
    good, inside = rows["outcome"] == "converged", rows["poses_outside_z"] == 0
    lost = rows["outcome"] == "target_lost"
    counts = {
        "converged": good, "target_lost": lost, "otherwise": ~good & ~lost,
        "ways_inside_z": inside, "ways_inside_z_converged": inside & good,
    }  # fmt: skip
    extremes = ("error_growth", "error_peak", "estimate_error_m", "estimate_error_rad")
    return {
        "runs": len(rows),
        **{name: int(which.sum()) for name, which in counts.items()},
        **{name: int(rows[name].sum()) for name in ("poses_checked", "poses_outside_z")},
        "least_margin": rows["least_margin"].min(),
        **{f"largest_{name}": rows[name].max() for name in extremes},
        "largest_position_error_m": max([0.0, *rows["position_error_m"][good]]),
    }


def numbers(rows: Frame) -> dict[str, Any]:
    """Counts and extremes by scheme and mode."""
    return {
        "modes": {
            scheme: {mode: loop_counts(some) for mode, some in mine.groupby("mode", sort=False)}
            for scheme, mine in rows.groupby("scheme", sort=False)
        }
    }


def count_table(rows: Frame) -> Frame:
    """How loops end, by scheme and mode."""
    groups = rows.groupby(["scheme", "mode"], sort=False)
    return Frame([{"scheme": s, "mode": m, **loop_counts(some)} for (s, m), some in groups])


def lost_table(rows: Frame) -> Frame:
    """Loops that did not converge."""
    names = ["scheme", "mode", "seed", "outcome", "start_pose", "time_s", "poses_outside_z",
             "poses_checked", "taut_at_end"]  # fmt: skip
    lost = rows[rows["outcome"] != "converged"][names]
    return lost.assign(start_pose=[np.round(pose[4:], 2).tolist() for pose in lost["start_pose"]])


def managed(rows: Frame) -> tuple[list[bool], str]:
    """Loops that end with slack cables without tension management: do they converge with it?"""
    modes = {mode: some.set_index(["scheme", "seed"]) for mode, some in rows.groupby("mode")}
    alone, ends = modes[PLAIN], modes[MANAGED]["outcome"]
    good, arrived = alone["outcome"] == "converged", ends == "converged"
    hung = alone[~good & (alone["taut_at_end"] < CABLES)]
    words = [
        f"{scheme} start {seed} at ({', '.join(f'{x:.2f}' for x in row['start_pose'][4:])}) m on "
        f"{row['taut_at_end']} cables, with it {ends[scheme, seed]}"
        for (scheme, seed), row in hung.head().iterrows()
    ]
    return arrived[hung.index].tolist(), (
        f"{'; '.join(words) or 'no loop ends so'}; {good.sum()} and {arrived.sum()} of {len(ends)} "
        f"converge without and with it, {(good & ~arrived).sum()} without it alone"
    )


def error_figure(rows: Frame, scheme: str) -> Figure:
    """|e| of every loop of a scheme over time."""
    modes = modes_of(rows, scheme)
    figure, panels = new_figure(
        1, len(modes), (max(7.0, 3.5 * len(modes)), 5.0),
        f"Feature error |e| of every closed loop, relative to its start, {scheme}",
    )  # fmt: skip
    for axes, (mode, some) in zip(np.ravel(panels), modes.items(), strict=True):
        for outcome, arrays in zip(some["outcome"], some["arrays"], strict=True):
            curve = arrays["curve"]
            share = np.maximum(curve / max(curve[0], 1e-12), LEAST_DRAWN_SHARE)
            axes.plot(
                np.linspace(0.0, 1.0, len(curve)), share, **line_style(look_of(outcome)), **THIN
            )
        limits = (LEAST_DRAWN_SHARE, 3.0)
        axes.set(yscale="log", xlabel="time / duration of the run [-]", ylim=limits, title=mode)
    np.ravel(panels)[0].set_ylabel("|e| / |e| at the start [-]")
    _legend(figure, modes)
    return figure


def path_figure(rows: Frame, scheme: str) -> Figure:
    """Paths of the platform of every loop of a scheme."""
    modes = modes_of(rows, scheme)
    figure, panels = new_figure(
        2, len(modes), (max(7.0, 3.5 * len(modes)), 8.4),
        f"Paths of the platform, Po, in the world frame W, from above and from the side, {scheme}",
    )  # fmt: skip
    grid = np.reshape(panels, (2, len(modes)))
    for column, (mode, some) in enumerate(modes.items()):
        for outcome, arrays in zip(some["outcome"], some["arrays"], strict=True):
            look, way = look_of(outcome), arrays["way"]
            for axes, up in zip(grid[:, column], (5, 6), strict=True):
                axes.plot(way[:, 4], way[:, up], **line_style(look), **THIN)
                axes.plot(*way[0, [4, up]], look.marker, color=look.color, markersize=3)
        for axes, name in zip(grid[:, column], "yz", strict=True):
            axes.set(aspect="equal", xlabel="x in W [m]", ylabel=f"{name} in W [m]")
        grid[0, column].set_title(mode)
    _legend(figure, modes)
    return figure


def modes_of(rows: Frame, scheme: str) -> dict[str, Frame]:
    """Loops of a scheme by mode."""
    some = rows[rows["scheme"] == scheme]
    if not len(some):
        raise NothingToDraw
    return dict([*some.groupby("mode", sort=False)])


def look_of(outcome: str) -> Look:
    """Look of curves by how their run ended."""
    return OUTCOMES.get(outcome, OTHER_OUTCOME)


def _legend(figure: Figure, modes: dict[str, Frame]) -> None:
    words = {outcome for some in modes.values() for outcome in some["outcome"]}
    handles = [
        Line2D([], [], marker=look_of(word).marker, label=word.replace("_", " "),
               **line_style(look_of(word)))
        for word in sorted(words, key=lambda word: Outcome[word.upper()])
    ]  # fmt: skip
    figure.legend(handles=handles, loc="outside lower center", ncols=4)


STUDY = Study(
    name="stability-closed-loop",
    title="Closed loops from poses of the control stability workspace",
    source="servoing thesis 3.3, 3.4; 5.1, 5.2.1",
    cases=cases,
    parameters=parameters,
    numbers=numbers,
    finds={"managed": managed},
    tables={f"{ROBOT}: loops from poses of SZ": count_table, "Not converged": lost_table},
    figures={
        f"{name}_{scheme}": partial(draw, scheme=scheme)
        for scheme in SCHEMES
        for name, draw in (("errors", error_figure), ("ways", path_figure))
    },
)
