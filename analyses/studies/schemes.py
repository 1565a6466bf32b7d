"""Study: schemes of visual servoing beside each other, from the same starts.

It compares image-based, pose-based, 2 1/2 D, partitioned and switching servoing: turns about the
optical axis and drawn starts of a camera that moves as it is told, and approaches of ACROBOT with a
wrong model. Servoing thesis 1.4.1 says of each what it is good for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.figures import line_style, new_figure
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study, select, summary
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import exponential, pose_from_angles, pose_from_row, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.palette import nth_look
from cdpr_drake.servoing.controller import ServoController
from cdpr_drake.servoing.pose_features import seen_pose_error
from cdpr_drake.systems.controllers.feature_servo import control_step
from cdpr_drake.systems.diagrams.controller import make_controller
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.servo_models import servo_model
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget

TURNS, FREE, ROBOT = TRIALS = ("turns", "free camera", "ACROBOT")
"""What is run."""

SCENARIO = "acrobot_ibvs"
"""Its camera of 640 x 480 px and its four dots, a square of 60 mm."""

VARIANTS: dict[str, tuple[str, ...]] = {
    "ibvs": ("controller.scheme=ibvs",),
    "pbvs": ("controller.scheme=pbvs",),
    "pbvs-line": ("controller.scheme=pbvs-line",),
    "2.5d": ("controller.scheme=2.5d",),
    "partitioned": ("controller.scheme=partitioned",),
    "partitioned, turned": (
        "controller.scheme=partitioned", "controller.partition={goal: turned}",
    ),
    "partitioned, field": (
        "controller.scheme=partitioned", "controller.partition={edge_distance: 40}",
    ),
    "switching": ("controller.scheme=switching",),
}  # fmt: skip
"""Schemes by name; the partition as published, with goals that turn, with a field at the edges."""

DESIRED = 0.15
"""Depth of the dots at the goal, straight ahead [m]."""

LAW = (
    "controller.lambda_0=1", "controller.lambda_infinity=1", "controller.lambda_slope=0",
    f"desired.position=[0, 0, {DESIRED}]",
)  # fmt: skip
"""The same constant gain for all: errors of different units would make adaptive ones differ."""

TURNS_DEG = (*range(15, 180, 15), 179)
"""Turns about the optical axis from the desired pose [deg]; at 180 their sense is a matter of
rounding."""

STARTS, QUICK_STARTS = 100, 8
"""Drawn starts of a free camera and of ACROBOT, each."""

FREE_TIME, ROBOT_TIME = 15.0, 25.0
"""How long a run may take [s]."""

ARRIVED_DISTANCE, ARRIVED_ANGLE = 1e-3, 0.5
"""Within which a free camera has arrived, after which it may not leave again [m, deg]."""

TILT, TURN = 25.0, 150.0
"""Largest angle of a drawn camera across and about the axis that looks at the dots [deg]."""

NEAREST, FARTHEST = 0.15, 0.5
"""Its depth [m]."""

MIDDLE, SPREAD = (0.15, -0.10, 0.30), (0.12, 0.12, 0.08)
"""Place over the dots from which ACROBOT starts, and how far off along each axis [m]."""

ROBOT_TILT, ROBOT_YAW, TARGET_YAW = 15.0, 25.0, 40.0
"""Largest angles of its start about x and y, and about z, and of the dots [deg]."""

WRONG = (
    "perturbations.exit_points=0.01", "perturbations.anchor_points=0.005",
    "perturbations.camera_pose_shift={distance: 0.01, angle_deg: 3}",
    "perturbations.initial_pose_shift={distance: 0.02, angle_deg: 3}",
)  # fmt: skip
"""What the servo of ACROBOT believes wrongly, in directions that depend on the run's number."""

SEED = 23
"""Of the starts."""

PERIOD = 0.04
"""Between two steps of a free camera [s]."""


# What is run.


def cases(form: Form) -> Iterator[Case]:
    """Each scheme on each turn, once, and from drawn starts, whose numbers are seeds."""
    for scheme in VARIANTS:
        for turn in TURNS_DEG:
            keys = {"trial": TURNS, "scheme": scheme, "turn_deg": turn}
            yield Case(keys=keys, call=partial(turn_row, scheme, turn))
    for trial, call in ((FREE, free_row), (ROBOT, robot_row)):
        for scheme in VARIANTS:
            yield Case(
                keys={"trial": trial, "scheme": scheme}, call=partial(call, scheme),
                seeds=form.times(STARTS, QUICK_STARTS),
            )  # fmt: skip


def parameters(form: Form) -> Mapping[str, Any]:
    """What all runs have in common, and the starts that are drawn."""
    count = form.times(STARTS, QUICK_STARTS)
    return {
        "scenario": SCENARIO, "variants": VARIANTS, "desired": DESIRED, "law": LAW,
        "turns_deg": TURNS_DEG, "free_time": FREE_TIME, "robot_time": ROBOT_TIME,
        "arrived_distance": ARRIVED_DISTANCE, "arrived_angle": ARRIVED_ANGLE, "tilt": TILT,
        "turn": TURN, "nearest": NEAREST, "farthest": FARTHEST, "middle": MIDDLE,
        "spread": SPREAD, "robot_tilt": ROBOT_TILT, "robot_yaw": ROBOT_YAW,
        "target_yaw": TARGET_YAW, "wrong": WRONG, "seed": SEED, "period": PERIOD,
        "free_starts": [pose_row(X_CO).tolist() for X_CO in free_starts(count)],
        "robot_starts": robot_starts(count),
    }  # fmt: skip


def turn_row(scheme: str, turn_deg: float) -> dict[str, Any]:
    """A turn of a free camera about its axis, see `FreeCamera.run`."""
    return FreeCamera(scheme).run(turned(turn_deg), bounded=False)


def free_row(scheme: str, seed: int) -> dict[str, Any]:
    """A drawn start of a free camera, see `FreeCamera.run`; without depths and dots."""
    row = FreeCamera(scheme).run(free_starts(seed + 1)[seed], bounded=True)
    del row["depths_m"], row["dots_px"]
    return row


def robot_row(scheme: str, seed: int) -> dict[str, Any]:
    """A drawn start of ACROBOT, see `FreeCamera.run`; without depths and dots."""
    run = ServoRun(load_scenario(SCENARIO, robot_changes(scheme, seed))).simulate()
    log, servo = run.log, run.built
    poses = [
        servo.X_CO(pose_from_row(row), time)
        for row, time in zip(log["X_WP"], log["time"], strict=True)
    ]
    arrived, lost = run.outcome == Outcome.CONVERGED, run.outcome == Outcome.TARGET_LOST
    row = ended(arrived, lost, run.sim_time, log.get("servo_mode"), measured(poses))
    del row["depths_m"], row["dots_px"]
    return row


def robot_changes(scheme: str, number: int) -> list[str]:
    """What differs from the scenario in a run of ACROBOT."""
    place, angles, yaw = robot_starts(number + 1)[number]
    return [
        *VARIANTS[scheme], *LAW, *WRONG, f"seed={number}", f"duration={ROBOT_TIME}",
        f"initial_pose.position={place}", f"initial_pose.angles_deg={angles}",
        f"target.pose.position={[MIDDLE[0], MIDDLE[1], 0.0]}",
        f"target.pose.angles_deg={[0.0, 0.0, yaw]}", "camera.kind=projected", "log_rate=25",
        "integration.engine=compiled", "integration.loop=compiled",
    ]  # fmt: skip


class FreeCamera:
    """A camera without a robot, which moves as a scheme tells it, and sees without noise."""

    def __init__(self, variant: str) -> None:
        """For one of `VARIANTS`, with the law that the scenario's settings give."""
        scenario: Scenario = load_scenario(SCENARIO, [*VARIANTS[variant], *LAW])
        model = servo_model(scenario, load_robot(scenario.robot))
        # A platform that is its camera, whose cables are never too fast.
        believed = replace(model.believed, X_PC=RigidTransform(), cable_speed=np.inf)
        _, self.target, self.pinhole, self.X_CdO = scene()
        self.controller: ServoController = make_controller(
            scenario, believed, self.target, self.pinhole
        )

    def run(self, X_CO: RigidTransform, bounded: bool) -> dict[str, Any]:
        """Its motion from a start.

        Args:
            X_CO: The dots in the camera at the start [m].
            bounded: True if a run is lost when a dot leaves the image.

        Returns:
            arrived; lost: True if the target left the image; time_s: how long it took; switches,
            and bound_share: largest share of its bound that L_P or L_I reached, of a scheme that
            switches; image_path_px: mean length of the dots' paths in the image; retreat_m: how
            much farther from the dots the camera went than start and goal are; room_px: least
            distance of a dot from the image's edges; depths_m and dots_px by step, shape (n,) and
            (n, 2, 4). Times and paths of runs that did not arrive are NaN.
        """
        servo, memory = self.controller, self.controller.fresh_memory()
        target, pinhole = self.target, self.pinhole
        poses, modes, lost = [X_CO], [], False
        for k in range(round(FREE_TIME / PERIOD)):
            p_CK = X_CO @ target.points
            lost = np.min(p_CK[2]) <= 0.0 or (bounded and not target.in_view(X_CO, pinhole))
            if lost:
                break
            seen = (X_CO, pinhole.project(p_CK).T.ravel())
            command, memory = control_step(
                servo, memory, (target, pinhole), seen, RigidTransform(), k * PERIOD
            )
            modes.append(servo.mode(memory))
            X_CO = exponential(-PERIOD * command.V_P) @ X_CO
            poses.append(X_CO)
        errors = np.array([seen_pose_error(X, self.X_CdO) for X in poses])
        at_goal = np.all(errors <= [ARRIVED_DISTANCE, np.radians(ARRIVED_ANGLE)], axis=1)
        first = len(at_goal) - np.argmin(at_goal[::-1]) if not np.all(at_goal) else 0
        mode = np.array(modes) if servo.law.switching is not None else None
        arrived = bool(at_goal[-1]) and not lost
        return ended(arrived, lost, float(first * PERIOD), mode, measured(poses))


def measured(poses: Sequence[RigidTransform]) -> dict[str, Any]:
    """Path in the image, retreat, room to the edges, depths, dots; see `FreeCamera.run`."""
    _, target, pinhole, X_CdO = scene()
    depths = np.array([X.translation()[2] for X in poses])
    p_CK = np.array([X @ target.points for X in poses])
    in_front = np.maximum(p_CK[:, 2:], 1e-6)
    scale = np.array([[pinhole.fx], [pinhole.fy]])
    dots = scale * p_CK[:, :2] / in_front + np.array([[pinhole.cx], [pinhole.cy]])
    path = float(np.mean(np.sum(np.linalg.norm(np.diff(dots, axis=0), axis=1), axis=0)))
    away = np.array([np.linalg.norm(X.translation()) for X in poses])
    retreat = float(np.max(away) - max(away[0], np.linalg.norm(X_CdO.translation())))
    size = np.array([[pinhole.width], [pinhole.height]])
    room = float(np.min([dots + 0.5, size - 0.5 - dots]))
    return {
        "image_path_px": path, "retreat_m": retreat, "room_px": room, "depths_m": depths,
        "dots_px": dots,
    }  # fmt: skip


def ended(
    arrived: bool, lost: bool, time: float, mode: Array | None, row: Mapping[str, Any]
) -> dict[str, Any]:
    """A row with how its run ended; without times and paths of one that did not arrive."""
    switches = share = np.nan
    if mode is not None and len(mode):
        switches, acting = float(mode[-1, 1]), mode[mode[:, 4] > 0.0]
        share = float(np.max(acting[:, 2:4] / acting[:, 4:])) if len(acting) else np.nan
    nothing = {} if arrived else {"time_s": np.nan, "image_path_px": np.nan}
    return {
        "arrived": arrived, "lost": lost, "time_s": time, "switches": switches,
        "bound_share": share, **row, **nothing,
    }  # fmt: skip


@cache
def scene() -> tuple[Scenario, PointTarget, Pinhole, RigidTransform]:
    """The scenario with the law of all schemes, its dots, its camera, and X_CO at the goal."""
    scenario: Scenario = load_scenario(SCENARIO, list(LAW))
    target = scenario.target.target()
    assert isinstance(target, PointTarget)
    pinhole = servo_model(scenario, load_robot(scenario.robot)).pinhole
    return scenario, target, pinhole, scenario.desired.transform()


def turned(angle: float) -> RigidTransform:
    """The dots in a camera that is turned about its axis from the desired pose [deg]."""
    return pose_from_angles(np.zeros(3), np.radians([0.0, 0.0, angle])) @ scene()[-1]


@cache
def free_starts(count: int) -> tuple[RigidTransform, ...]:
    """The first starts of a free camera, which see all dots; the same for all schemes."""
    _, target, pinhole, X_CdO = scene()
    random = np.random.default_rng(SEED)
    starts: list[RigidTransform] = []
    half = np.array([0.5 * pinhole.width / pinhole.fx, 0.5 * pinhole.height / pinhole.fy])
    while len(starts) < count:
        depth = random.uniform(NEAREST, FARTHEST)
        x, y = depth * half * random.uniform(-1.0, 1.0, 2)
        tilt = random.uniform(-TILT, TILT, 2)
        turn = pose_from_angles(np.zeros(3), np.radians([*tilt, random.uniform(-TURN, TURN)]))
        X_CO = RigidTransform(turn.rotation() @ X_CdO.rotation(), [x, y, depth])
        if target.in_view(X_CO, pinhole):
            starts.append(X_CO)
    return tuple(starts)


@cache
def robot_starts(count: int) -> tuple[tuple[list[float], list[float], float], ...]:
    """The first starts of ACROBOT, position [m], angles [deg], and the dots' yaw [deg], from which
    the camera would see all dots; the same for all schemes."""
    scenario, target, pinhole, _ = scene()
    X_PC = load_robot(scenario.robot).camera_mount(scenario.camera.mount).pose.transform()
    random = np.random.default_rng(SEED + 1)
    starts: list[tuple[list[float], list[float], float]] = []
    while len(starts) < count:
        place = np.round(np.array(MIDDLE) + np.array(SPREAD) * random.uniform(-1.0, 1.0, 3), 4)
        limits = np.array([ROBOT_TILT, ROBOT_TILT, ROBOT_YAW])
        angles = np.round(limits * random.uniform(-1.0, 1.0, 3), 2)
        yaw = float(np.round(random.uniform(-TARGET_YAW, TARGET_YAW), 1))
        X_WO = pose_from_angles(np.array([*MIDDLE[:2], 0.0]), np.radians([0.0, 0.0, yaw]))
        X_WP = Pose(position=place, angles_deg=angles).transform()
        if target.in_view((X_WP @ X_PC).inverse() @ X_WO, pinhole):
            starts.append((place.tolist(), angles.tolist(), yaw))
    return tuple(starts)


# What is shown.

DRAWN = ("ibvs", "pbvs-line", "partitioned", "partitioned, turned", "switching")
"""Schemes in the panels over turns; pbvs and 2.5d do there what pbvs-line does."""

NOTHING = 1e-5
"""Retreat that is drawn where there is none, or less [m]."""


def table(trial: str, rows: Frame) -> Frame:
    """Medians of the runs that arrived, worst of all."""
    return summary(select(rows, trial=trial), "scheme", {
        "runs": ("lost", "size"), "arrived": ("arrived", "sum"), "lost": ("lost", "sum"),
        "time [s]": ("time_s", "median"), "image path [px]": ("image_path_px", "median"),
        "worst retreat [m]": ("retreat_m", "max"), "switched": ("switches", _switched),
        "share of bound": ("bound_share", "max"),
    })  # fmt: skip


def _switched(switches: Any) -> float:
    """How many runs switched; NaN of a scheme that does not."""
    return float((switches > 0.0).sum()) if switches.notna().any() else np.nan


def figure(rows: Frame) -> Figure:
    """Retreats and depths on turns, failures from drawn starts."""
    drawn, axes = new_figure(2, 2, (14.0, 10.0), "Schemes of visual servoing")
    retreats, depths, *failures = axes.flat
    looks = {scheme: nth_look(k) for k, scheme in enumerate(VARIANTS)}
    for scheme in DRAWN:
        look, turns = looks[scheme], rows[(rows["trial"] == TURNS) & (rows["scheme"] == scheme)]
        retreats.semilogy(turns["turn_deg"], turns["retreat_m"].clip(lower=NOTHING), label=scheme,
                          marker=look.marker, markersize=4, **line_style(look))  # fmt: skip
        for arrays in turns["arrays"][turns["turn_deg"] == TURNS_DEG[-1]]:
            values = arrays["depths_m"]
            times = PERIOD * np.arange(len(values))
            depths.semilogy(times, values, label=scheme, **line_style(look))
    retreats.set(xlabel="turn about the optical axis [deg]",
                 ylabel=f"retreat [m]; at $10^{{{np.log10(NOTHING):.0f}}}$: none",
                 title="How much farther than start and goal the camera goes")  # fmt: skip
    retreats.legend()
    depths.set(xlabel="time [s]", ylabel="depth of the dots [m]", ylim=(0.03, 10.0),
               title=f"A turn by {TURNS_DEG[-1]} deg")  # fmt: skip
    for axis, trial in zip(failures, (FREE, ROBOT), strict=True):
        runs = rows[rows["trial"] == trial].groupby("scheme", sort=False)
        shares = runs[["lost", "arrived"]].mean()
        places, colors = range(len(shares)), [looks[scheme].color for scheme in shares.index]
        lost, short = 100.0 * shares["lost"], 100.0 * (1.0 - shares["arrived"] - shares["lost"])
        axis.bar(places, lost, color=colors, edgecolor="black")
        bars = axis.bar(places, short, bottom=lost, color="white", edgecolor="black", hatch="//")
        axis.bar_label(bars, [f"{a:.0f} + {b:.0f}" for a, b in zip(lost, short, strict=True)])
        axis.set_xticks(places, shares.index, rotation=30, ha="right", rotation_mode="anchor")
        axis.set(ylabel="runs [%]", title=f"{trial}: target lost (full) + not there (hatched)")
        axis.set_ylim(0.0, max(5.0, 1.2 * axis.get_ylim()[1]))
    return drawn


STUDY = Study(
    name="schemes",
    title="Schemes of visual servoing beside each other, from the same starts",
    source="servoing thesis 1.4.1",
    cases=cases,
    parameters=parameters,
    tables={
        f"{trial}: medians of those that arrived, worst of all": partial(table, trial)
        for trial in TRIALS
    },
    figures={"schemes": figure},
)
