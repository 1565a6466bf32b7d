"""Closed loops from poses of a control stability workspace, under perturbations of full size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.simulation.visual_servo_run import RunResult, run_scenario
from cdpr_drake.analyses.studies.closed_loops.kinematic_servo import STEP, kinematic_path
from cdpr_drake.analyses.studies.closed_loops.servo_models import (
    Perturbation,
    PerturbedServo,
    perturbed_scenario,
    perturbed_servo,
)
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import (
    pose_error,
    pose_from_angles,
    pose_from_row,
    pose_row,
    pose_rows_distance,
)
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability, worst_perturbations
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.workspaces.static_feasibility import StaticCase, statically_feasible

LOOPS = ("kinematic", "shifted", "control_integration")
"""How the loop is closed: kinematics alone, or the simulated robot with an estimator."""

MODES = {
    "kinematic": "what the criterion is about: kinematics, estimate off by a constant error",
    "shifted": "simulated robot, estimate off by a constant error",
    "control_integration": "simulated robot, estimate by control integration from a wrong start",
    "kinematic, worst": "as kinematic, with the worst perturbation that a search finds",
    "shifted, worst": "as shifted, with the worst perturbation that a search finds",
    "shifted, worst, managed": "as shifted, worst, with tension management",
}
"""How the loop is closed and under which perturbation; elsewhere its directions are random."""

PLAIN, MANAGED = "shifted, worst", "shifted, worst, managed"
"""Two of them, without and with tension management."""

MANAGEMENT = "tension_management={kind: constant, threshold: [1.0], gain: 0.003}"
"""What the managed loops add; the gain is for cables as stiff as their fibre, for which the
published one is too high."""

COLUMNS = (
    "outcome",
    "time_s",
    "position_error_m",
    "rotation_error_rad",
    "error_growth",
    "least_margin",
    "poses_checked",
    "poses_outside_z",
    "estimate_error_m",
    "estimate_error_rad",
    "taut_at_end",
    "error_peak",
)
"""Numbers of a run: `Outcome`; time (kinematic: times the gain); true errors at the end; largest
rise of |e| between two samples, as a share of its start; least margin of Pi for the run's own
perturbation on its path; poses of the path that were judged, and those not in Z; largest error of
the pose estimate; cables that pull at the end (kinematic: all of them); largest |e| over |e| at the
start."""

WAY_POSES = 10
"""Poses of a path that are judged by the verdict, both ends among them."""

CURVE = 80
"""Samples of |e| that are kept of a run."""

CANDIDATES = 64
"""Poses that are drawn at a time."""

TILT_DEG, YAW_DEG = 15.0, 45.0
"""Starts are turned by angles phi, theta and psi up to these [deg]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ClosedLoopTask:
    """Sweep task: does the servo converge from the starts?

    Attributes:
        scenario: The task of the servo; starts and perturbations are put in.
        case: The same for the verdict.
        bounds: What limits the perturbations.
        starts: Poses of the platform, rows as `pose_row`, shape (n, 7).
        verdict: How poses of the path are judged.
        options: How hard to look.
        loop: One of `LOOPS`.
        seed: Seed of the perturbations.
        worst: Whether every perturbation is the worst that a search finds at the start, instead
            of one in random directions.
    """

    scenario: Scenario
    case: StabilityCase
    bounds: PerturbationBounds
    starts: Array
    verdict: str
    options: VerdictOptions
    loop: str
    seed: int
    worst: bool = False

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """`runs`, shape (n, columns), `curve`, (n, CURVE), `way`, (n, WAY_POSES, 7)."""
        found = [self._run(number) for number in range(start, stop)]
        names = ("runs", "curve", "way")
        return {name: np.array([one[k] for one in found]) for k, name in enumerate(names)}

    def perturbation(self, number: int) -> Perturbation:
        """The perturbation of one start: random, as large as the bounds allow, or the worst."""
        pose = self.starts[number]
        if self.worst:
            _, found = worst_perturbations(self.case, self.bounds, pose[None], self.options)
            return Perturbation.from_vector(found[0])
        drawn = draw_perturbations(pose, self.bounds, self.case.m, 1, self.seed)
        return Perturbation.from_vector(drawn[0])

    def _run(self, number: int) -> tuple[Array, Array, Array]:
        X_WP = pose_from_row(self.starts[number])
        perturbation = self.perturbation(number)
        servo = perturbed_servo(self.scenario, perturbation)
        if self.loop == "kinematic":
            path = kinematic_path(servo, X_WP)
            rows = np.array([pose_row(X) for X in path.poses])
            believed = np.array([pose_row(perturbation.platform(X)) for X in path.poses])
            outcome, errors, time = float(path.outcome), path.errors, STEP * len(rows)
            taut = self.case.m
        else:
            made = perturbed_scenario(self.scenario, X_WP, perturbation)
            made.estimator.kind = self.loop
            made.sensors.tracker = "ideal"
            result = run_scenario(choose_compiled_loop(made))
            rows, believed = result.log["X_WP"], result.log["X_WP_estimated"]
            outcome, time = float(result.outcome), result.sim_time
            errors = seen_errors(result)
            taut = int(np.sum(result.log["slack"][-1] == 0.0))
        way = np.linspace(0, len(rows) - 1, WAY_POSES).round().astype(int)
        judged = judge_stability(self.case, self.bounds, rows[way], self.verdict, self.options)
        margins = [servo.margin(pose_from_row(rows[k]), pose_from_row(believed[k])) for k in way]
        final = pose_error(servo.X_CO(pose_from_row(rows[-1])), self.scenario.desired.transform())
        off, turned = pose_rows_distance(rows, believed)
        growth = float(np.max(np.diff(errors), initial=0.0)) / max(float(errors[0]), 1e-12)
        numbers = np.array(
            [
                outcome,
                time,
                *final,
                growth,
                min(margins),
                WAY_POSES,
                np.sum(~judged.stable),
                np.max(off),
                np.max(turned),
                taut,
                float(np.max(errors)) / max(float(errors[0]), 1e-12),
            ]
        )
        samples = np.linspace(0, len(errors) - 1, CURVE).round().astype(int)
        return numbers, errors[samples], rows[way]


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


def stable_starts(
    servo: PerturbedServo,
    case: StabilityCase,
    statics: StaticCase,
    bounds: PerturbationBounds,
    *,
    box: tuple[Array, Array],
    count: int,
    verdict: str,
    options: VerdictOptions,
    seed: int,
) -> Starts:
    """Random poses of SZ from which the target is seen, position and angles evenly distributed.

    Args:
        servo: The servo, for its camera and target.
        case: The same for the verdict.
        statics: What the cables hold.
        bounds: What limits the perturbations.
        box: Lower and upper corner of where Po may be, shape (3,) each [m].
        count: How many poses.
        verdict: How they are judged.
        options: How hard to look.
        seed: Seed of the poses.
    """
    random = np.random.default_rng([seed, 7])
    settings = servo.scenario.camera
    mount = servo.robot.camera_mount(settings.mount)
    pinhole = load_camera(mount.model).pinhole(settings.width, settings.height)
    widest = np.radians([TILT_DEG, TILT_DEG, YAW_DEG])
    rows: list[Array] = []
    drawn = not_held = not_seen = not_stable = 0
    while len(rows) < count:
        positions = random.uniform(*box, (CANDIDATES, 3))
        angles = random.uniform(-widest, widest, (CANDIDATES, 3))
        poses = [pose_from_angles(p, a) for p, a in zip(positions, angles, strict=True)]
        turns = np.array([X.rotation().matrix() for X in poses])
        held = statically_feasible(statics, positions, turns)
        seen = np.array([servo.target.in_view(servo.X_CO(X), pinhole) for X in poses])
        asked = np.flatnonzero(held & seen)
        candidates = np.array([pose_row(poses[k]) for k in asked]).reshape(-1, 7)
        stable = np.zeros(0, bool)
        if len(candidates):
            stable = judge_stability(case, bounds, candidates, verdict, options).stable
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
