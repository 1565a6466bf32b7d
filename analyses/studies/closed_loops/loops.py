"""Closed loops from poses of a control stability workspace, under perturbations of full size."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.simulation.visual_servo_run import RunResult, run_scenario
from cdpr_drake.analyses.studies.closed_loops.kinematic_servo import STEP, kinematic_path
from cdpr_drake.analyses.studies.framework.runs import Row
from cdpr_drake.analyses.studies.framework.servo_cases import servo_case
from cdpr_drake.analyses.studies.framework.servo_models import (
    Perturbation,
    PerturbedServo,
    perturbed_scenario,
    perturbed_servo,
)
from cdpr_drake.analyses.studies.framework.study import Case
from cdpr_drake.analyses.workspaces.static_feasible import static_case
from cdpr_drake.arrays import Array
from cdpr_drake.errors import StabilityError
from cdpr_drake.geometry.poses import (
    pose_error,
    pose_from_angles,
    pose_from_row,
    pose_row,
    pose_rows_distance,
)
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability, worst_perturbations
from cdpr_drake.systems.cameras.camera_settings import servo_pinhole
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.workspaces.static_feasibility import statically_feasible

ROBOT = "acrobot_large"
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

LOWEST = 0.15
"""Starts keep this height, so that the tag is in front of the camera [m]."""

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
"""Two of them, without and with tension management."""

MANAGEMENT = "tension_management={kind: constant, threshold: [1.0], gain: 0.003}"
"""What the managed loops add; the gain is for cables as stiff as their fibre, for which the
published one is too high."""

WAY_POSES = 10
"""Poses of a path that are judged by the verdict, both ends among them."""

CURVE = 80
"""Samples of |e| that are kept of a run."""

CANDIDATES = 64
"""Poses that are drawn at a time."""

TILT_DEG, YAW_DEG = 15.0, 45.0
"""Starts are turned by angles phi, theta and psi up to these [deg]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LoopSetup:
    """What all loops of a scheme have in common.

    Attributes:
        scenario: The task of the servo; starts and perturbations are put in.
        managed: The same with tension management.
        servo: The servo without perturbation.
        case: The same for the verdict.
        bounds: What limits the perturbations.
        box: Lower and upper corner of where Po may start, shape (3,) each [m].
    """

    scenario: Scenario
    managed: Scenario
    servo: PerturbedServo
    case: StabilityCase
    bounds: PerturbationBounds
    box: tuple[Array, Array]


@cache
def loop_setup(scheme: str) -> LoopSetup:
    """What all loops of a scheme have in common."""
    settings = [*SETTINGS, f"controller.scheme={scheme}"]
    scenario = load_scenario("acrobot_pbvs", settings)
    common = servo_case(scenario, LOWEST)
    return LoopSetup(
        scenario=scenario,
        managed=load_scenario("acrobot_pbvs", [*settings, MANAGEMENT]),
        servo=common.servo,
        case=common.case,
        bounds=common.bounds,
        box=common.box,
    )


def measure(case: Case, seed: int) -> Row:
    """Closes a loop from the start of this number: does the servo converge?

    Args:
        case: Its keys are the mode, one of `MODES`, and the scheme; its data are the starts.
        seed: Number of the start.

    Returns:
        outcome; time_s (kinematic: times the gain); position_error_m, rotation_error_rad: true
        errors at the end; error_growth: largest rise of |e| between two samples, as a share of its
        start; least_margin of Pi for the run's own perturbation on its path; poses_checked of the
        path, and of these poses_outside_z; estimate_error_m, estimate_error_rad: largest errors of
        the pose estimate; taut_at_end: cables that pull then (kinematic: all of them); error_peak:
        largest |e| over |e| at the start; start_pose as `pose_row`; curve: |e|, shape (CURVE,);
        way, shape (WAY_POSES, 7).
    """
    mode, setup = case.keys["mode"], loop_setup(case.keys["scheme"])
    start = np.array(case.data[seed])
    perturbation = perturbation_of(setup, start, worst="worst" in mode)
    scenario = setup.managed if mode == MANAGED else setup.scenario
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
        result = run_scenario(choose_compiled_loop(made))
        rows, believed = result.log["X_WP"], result.log["X_WP_estimated"]
        outcome, errors, time = Outcome(result.outcome), seen_errors(result), result.sim_time
        taut = int(np.sum(result.log["slack"][-1] == 0.0))
    way = np.linspace(0, len(rows) - 1, WAY_POSES).round().astype(int)
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
        "poses_checked": WAY_POSES, "poses_outside_z": int(np.sum(~judged.stable)),
        "estimate_error_m": np.max(off), "estimate_error_rad": np.max(turned),
        "taut_at_end": taut, "error_peak": float(np.max(errors)) / first,
        "start_pose": start.tolist(), "curve": errors[samples], "way": rows[way],
    }  # fmt: skip


def perturbation_of(setup: LoopSetup, start: Array, *, worst: bool) -> Perturbation:
    """The perturbation of a start: random, as large as the bounds allow, or the worst one.

    Args:
        setup: The loops.
        start: As `pose_row`.
        worst: Whether it is the worst that a search finds at the start, instead of one in random
            directions.
    """
    if worst:
        _, found = worst_perturbations(setup.case, setup.bounds, start[None], OPTIONS)
    else:
        found = draw_perturbations(start, setup.bounds, setup.case.m, 1, SEED)
    return Perturbation.from_vector(found[0])


def seen_errors(result: RunResult) -> Array:
    """|e| of the features at the control steps at which the target was seen, shape (n,)."""
    errors = np.linalg.norm(result.log["error"], axis=1)
    # The servo's first output comes after its first image; a lost target leaves the last error.
    seen = errors[(errors > 0.0) & (result.log["gain"][:, 0] > 0.0)]
    return seen if len(seen) else np.zeros(1)


@dataclass(frozen=True, eq=False)
class Starts:
    """Poses to start from.

    Attributes:
        poses: Rows as `pose_row`, shape (n, 7) [-, m].
        drawn: Poses that were drawn for them.
        not_held: Of these, those that tensions within the bounds do not hold.
        not_seen: Of the rest, those from which the target is not in the image.
        not_stable: Of the rest, those that the verdict does not find stable.
    """

    poses: Array
    drawn: int
    not_held: int
    not_seen: int
    not_stable: int


@cache
def stable_starts(scheme: str, count: int) -> Starts:
    """Random poses of SZ from which the target is seen, position and angles evenly distributed.

    Args:
        scheme: Visual servoing scheme.
        count: How many poses; the first are the same for any count.

    Raises:
        StabilityError: The desired pose is not stable, or cannot be held.
    """
    setup = loop_setup(scheme)
    servo, case, bounds = setup.servo, setup.case, setup.bounds
    statics = static_case(servo.robot, pulleys=False)
    goal = desired_platform(servo)
    goal_held = statically_feasible(
        statics, goal.translation()[None], goal.rotation().matrix()[None]
    )[0]
    if not (
        goal_held
        and judge_stability(case, bounds, pose_row(goal)[None], VERDICT, OPTIONS).stable[0]
    ):
        raise StabilityError("closed loop: the desired pose is not stable, or cannot be held")
    random = np.random.default_rng([SEED, 7])
    settings = servo.scenario.camera
    pinhole = servo_pinhole(settings, servo.robot)
    widest = np.radians([TILT_DEG, TILT_DEG, YAW_DEG])
    rows: list[Array] = []
    drawn = not_held = not_seen = not_stable = 0
    while len(rows) < count:
        positions = random.uniform(*setup.box, (CANDIDATES, 3))
        angles = random.uniform(-widest, widest, (CANDIDATES, 3))
        poses = [pose_from_angles(p, a) for p, a in zip(positions, angles, strict=True)]
        turns = np.array([X.rotation().matrix() for X in poses])
        held = statically_feasible(statics, positions, turns)
        seen = np.array([servo.target.in_view(servo.X_CO(X), pinhole) for X in poses])
        asked = np.flatnonzero(held & seen)
        candidates = np.array([pose_row(poses[k]) for k in asked]).reshape(-1, 7)
        stable = np.zeros(0, bool)
        if len(candidates):
            stable = judge_stability(case, bounds, candidates, VERDICT, OPTIONS).stable
        rows += list(candidates[stable])
        drawn += CANDIDATES
        not_held += int(np.sum(~held))
        not_seen += int(np.sum(held & ~seen))
        not_stable += int(np.sum(~stable))
    return Starts(np.array(rows[:count]), drawn, not_held, not_seen, not_stable)


def desired_platform(servo: PerturbedServo) -> RigidTransform:
    """Pose of the platform at which the servo has what it wants."""
    X_CdO = servo.scenario.desired.transform()
    return servo.X_WO @ X_CdO.inverse() @ servo.X_PC.inverse()
