"""Study: two cameras, lengths, an IMU and depths fused, each failing or wrong in its turn.

Besides it starts with slack cables, as in case study IX: what takes slack up how soon, and how a
camera sees it. Source: servoing thesis, perspectives: an onboard and an external camera, fusion.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import bar_style, line_style, new_figure
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.studies.experiments import wrong_points
from cdpr_drake.analyses.studies.facts import MissingRuns
from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study, select, summary
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.poses import logarithm, pose_from_row, pose_rows_distance
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.palette import BOUND, SHADED, nth_look
from cdpr_drake.schema.typed_yaml import dump_typed
from cdpr_drake.systems.cameras.cable_camera import CableCamera
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.vision.cable_images import slack_from_image

SERVO, SLACK = "servo", "slack"
"""What is run: a servo on the fused pose, a start with slack cables."""

# Servos: sources, and what is wrong with them.

SCENARIO = "acrobot_fusion"

DURATION, QUICK_DURATION = 12.0, 1.0
"""Time of a run [s]; the servo arrives after about 8."""

RATE = 25.0
"""Rows of the log per second, as many as control steps [Hz]."""

SETTLED = 0.5
"""Time after which errors count [s]: the error of the start is corrected within it."""

TARGET = "{position: 0.01, rotation_deg: 1.0}"
"""How well the target's pose is known beforehand, as a camera in the world does not see it."""

ON_BOARD = ("estimator.sensor_fusion.external=false",)
EXTERNAL = ("estimator.sensor_fusion.on_board=false",)
IMU = ("estimator.sensor_fusion.imu=true", "sensors.imu={type: adis16448}")
DEPTH = ("estimator.sensor_fusion.external_depth=kinect",)
NO_GATES = ("estimator.sensor_fusion.gate=0",)
ON_BOARD_WRONG = ("perturbations.camera_pose_shift={distance: 0.02, angle_deg: 1.0}",)
EXTERNAL_WRONG = ("perturbations.external_camera_shift={distance: 0.02, angle_deg: 1.0}",)
DOUBTED = (
    "estimator.sensor_fusion.on_board_doubt={}", "estimator.sensor_fusion.external_doubt={}",
)  # fmt: skip
"""Either camera may be worse than told, with the probability and the sizes that are default."""

DOUBT = "{probability: 0.5, position: 0.012, rotation_deg: 0.6}"
ON_BOARD_TOLD = (f"estimator.sensor_fusion.on_board_doubt={DOUBT}",)
EXTERNAL_TOLD = (f"estimator.sensor_fusion.external_doubt={DOUBT}",)
"""One camera may be wrong by what it is then wrong by, 2 cm and 1 deg in any direction."""

KNOCKED = (
    "estimator.platform_tag.fault={kind: off, start: 3.0, duration: 1000.0, "
    "offset: [0.012, -0.012, 0.0106], angles_deg: [0.6, -0.6, 0.53]}",
)
"""2 cm and 1 deg from 3 s on."""


def fault(camera: str, kind: str, duration: float = 3.0) -> tuple[str, ...]:
    """A fault of a camera that begins under way, while the platform is fastest."""
    return (f"{camera}.fault={{kind: {kind}, start: 2.0, duration: {duration}}}",)


ON_BOARD_DEAD, EXTERNAL_DEAD = fault("camera", "dead"), fault("estimator.platform_tag", "dead")

CONFIGURATIONS: dict[str, tuple[str, tuple[str, ...]]] = {
    "on_board": ("camera on board", ON_BOARD),
    "external": ("camera in the world", EXTERNAL),
    "both": ("both", ()),
    "on_board covered": ("on board, covered for 3 s", ON_BOARD + ON_BOARD_DEAD),
    "external covered": ("in the world, covered for 3 s", EXTERNAL + EXTERNAL_DEAD),
    "both, on_board covered": ("both, on board covered", ON_BOARD_DEAD),
    "both, external covered": ("both, in the world covered", EXTERNAL_DEAD),
    "both, on_board frozen": ("both, on board frozen", fault("camera", "frozen")),
    "both, external off": (
        "both, in the world off by 3 cm", fault("estimator.platform_tag", "off"),
    ),
    "on_board wrong": ("on board, 2 cm and 1 deg wrong", ON_BOARD + ON_BOARD_WRONG),
    "external wrong": ("in the world, 2 cm and 1 deg wrong", EXTERNAL + EXTERNAL_WRONG),
    "both, on_board wrong": ("both, on board wrong", ON_BOARD_WRONG),
    "both, external wrong": ("both, in the world wrong", EXTERNAL_WRONG),
    "both, external wrong, no gates": ("the same, nothing left out", EXTERNAL_WRONG + NO_GATES),
    "both, external knocked": ("both, in the world knocked after 3 s", KNOCKED),
    "both, doubted": ("both, doubted", DOUBTED),
    "both, on_board wrong, told": (
        "both, on board wrong, as told", ON_BOARD_WRONG + ON_BOARD_TOLD,
    ),
    "both, external wrong, told": (
        "both, in the world wrong, as told", EXTERNAL_WRONG + EXTERNAL_TOLD,
    ),
    "both, external wrong, doubted": (
        "both, in the world wrong, both doubted", EXTERNAL_WRONG + DOUBTED,
    ),
    "both, external wrong, told, on_board covered": (
        "both, in the world wrong, as told, on board covered",
        EXTERNAL_WRONG + EXTERNAL_TOLD + fault("camera", "dead", 1000.0),
    ),
    "both, external knocked, doubted": (
        "both, in the world knocked, both doubted", KNOCKED + DOUBTED,
    ),
    "both, imu": ("both and an IMU", IMU),
    "both, depth": ("both and depths", DEPTH),
    "external, imu": ("in the world and an IMU", EXTERNAL + IMU),
    "external, depth": ("in the world and depths", EXTERNAL + DEPTH),
    "all": ("both, an IMU and depths", IMU + DEPTH),
}  # fmt: skip
"""Words and changes of the scenario by name; encoders and tension sensors are read by each."""

THREE = ("on_board", "external", "both")
"""Those of the quick form."""


def servo_scenario(changes: Sequence[str], duration: float, seed: int) -> Scenario:
    """The scenario of a run: what is wrong is drawn normally, by what the filter is told.

    Args:
        changes: Items "key=value" of the scenario.
        duration: How long it runs [s].
        seed: By which it is drawn.
    """
    base = [
        "camera.fault=null", "perturbations={}", "estimator.compare=[]", "stop.hold=1000",
        "stop.target_lost=1000", "integration.engine=compiled", f"log_rate={RATE}",
        f"duration={duration}", f"seed={seed}",
        f"estimator.sensor_fusion.told_object={TARGET}",
    ]  # fmt: skip
    scenario = load_scenario(SCENARIO, base)
    filter_, random = scenario.estimator.sensor_fusion, np.random.default_rng([seed, 31])
    start, nothing = scenario.initial_pose, np.zeros(3)
    assert filter_.told_object is not None
    deviations = {
        "external_camera": (filter_.external_position, filter_.external_rotation_deg),
        "camera_pose": (filter_.on_board_position, filter_.on_board_rotation_deg),
        "told_object": (filter_.told_object.position, filter_.told_object.rotation_deg),
        "initial_pose": (filter_.start_position, filter_.start_rotation_deg),
    }
    poses = []
    for name, (distance, angle) in deviations.items():
        about = (start.position, start.angles_deg) if name == "initial_pose" else (nothing, nothing)
        position = about[0] + distance * random.standard_normal(3)
        angles_deg = about[1] + angle * random.standard_normal(3)  # as good as a rotation vector
        p, a = ([round(float(v), 9) for v in values] for values in (position, angles_deg))
        poses.append(f"perturbations.{name}={{position: {p}, angles_deg: {a}}}")
    return load_scenario(SCENARIO, [*base, *poses, *changes])


def servo_row(changes: Sequence[str], duration: float, seed: int) -> dict[str, Any]:
    """A run of a configuration; rows of curves after an early end are NaN.

    Returns:
        servo_m, servo_rad: of the target in the camera from where it should be, at the end;
        final_m, final_rad, mean_m, mean_rad, largest_m, largest_rad: error of the estimate at the
        end, in the mean, and at most; nees: normalized error squared at the end [-]; on_board,
        external, lengths, external_left_out: share of steps at which a source was used, and at
        which the camera in the world was left out; lost_s: time without a target to steer by;
        expected_m: what the filter expects its error to be at the end, by its covariance;
        wrong_on_board, wrong_external: probability at the end that a camera is worse than told, NaN
        if that is not asked; nis: of each of five sources in the mean over the run, over its
        degrees of freedom [-]; estimate_m, target_m, nees_by_row, shape (rows of the log,):
        distance of the estimate from the truth, of the target in the camera from where it should
        be, normalized error squared [-].
    """
    result = ServoRun(servo_scenario(changes, duration, seed)).simulate()
    log, servo = result.log, result.built
    times, count = log["time"], round(duration * RATE) + 1
    distance, angle = pose_rows_distance(log["X_WP"], log["X_WP_estimated"])
    target = np.array([
        servo.seen_error(pose_from_row(row), float(time))
        for row, time in zip(log["X_WP"], times, strict=True)
    ])  # fmt: skip
    nees = normalized_errors(log)
    curves = Frame({"estimate_m": distance, "target_m": target[:, 0], "nees_by_row": nees})
    later = times >= min(SETTLED, 0.5 * duration)
    sources = log["fusion_sources"][later]
    stopped = np.linalg.norm(log["cable_velocities"][later], axis=1) == 0.0
    nis = log["fusion_nis"][later]
    known = np.any(np.isfinite(nis), axis=0)
    means = np.full(nis.shape[1], np.nan)
    means[known] = np.nanmean(nis[:, known], axis=0)
    used = np.mean(sources[:, :3] > 0.0, axis=0)
    wrong = log["fusion_calibration"][-1].reshape(2, -1)[:, 0]
    return {
        "servo_m": target[-1, 0], "servo_rad": target[-1, 1],
        "final_m": distance[-1], "final_rad": angle[-1],
        "mean_m": np.mean(distance[later]), "mean_rad": np.mean(angle[later]),
        "largest_m": np.max(distance[later]), "largest_rad": np.max(angle[later]),
        "nees": nees[-1], "on_board": used[0], "external": used[1], "lengths": used[2],
        "external_left_out": np.mean(sources[:, 1] < 0.0), "lost_s": np.sum(stopped) / RATE,
        "expected_m": np.sqrt(np.trace(log["fusion_covariance"][-1].reshape(6, 6)[3:, 3:])),
        "wrong_on_board": wrong[0], "wrong_external": wrong[1], "nis": means.tolist(),
        **{name: values.to_numpy() for name, values in curves.reindex(range(count)).items()},
    }  # fmt: skip


def normalized_errors(log: Mapping[str, Array]) -> Array:
    """Errors of the estimate over its covariance, squared, shape (n,) [-]; the first is NaN."""
    nees = np.full(len(log["time"]), np.nan)
    for k in range(1, len(nees)):
        X_WE, X_WP = (pose_from_row(log[name][k]) for name in ("X_WP_estimated", "X_WP"))
        error = logarithm(X_WE.inverse() @ X_WP)
        nees[k] = error @ np.linalg.solve(log["fusion_covariance"][k].reshape(6, 6), error)
    return nees


# Starts with slack cables.

SLACK_SCENARIO = "acrobot_slack_start_tca"

WAYS = {
    "constant": "{kind: constant, threshold: [1.0], gain: 0.04}",
    "adaptive": "{kind: adaptive, gain_per_length: 2}",
    "length": "{kind: length}",
    "image": "{kind: image, gain: 0.04, allowance: 0.002}",
}
"""Ways to take up slack: the published one, its variants that know lengths, what a camera sees."""

SURPLUSES = (0.02, 0.04, 0.08)
"""Lengths that two cables are too long by at the start [m]."""

CABLES = [0, 1]

SLACK_DURATION, SLACK_RATE = 4.0, 50.0

TAUT = 1e-3
"""A cable that is too long by less counts as taut [m]."""

POINTS, NOISE = 15, 0.5
"""Points of a cable in the image, and their standard deviation [px]."""

SLACK_CHANGES = (
    "camera.kind=projected", "integration.engine=compiled", f"duration={SLACK_DURATION}",
    f"log_rate={SLACK_RATE}", "stop.target_lost=1000",
    "perturbations.initial_pose_shift={distance: 0.002, angle_deg: 0.2}", *wrong_points(),
)  # fmt: skip
"""Of all of them; what is believed wrongly is as in case study IX."""


def slack_row(way: str, surplus: float, seed: int) -> dict[str, Any]:
    """A start with slack cables.

    Returns:
        taut_s: when the last slack cable became taut; fastest_m_s: the fastest correction;
        estimate_m: the largest error of the pose estimate; of the slack that a camera sees while
        there is some, seen_error_m and seen_bias_m: the mean size of the error and the mean error,
        and seen_share: the share of images with it.
    """
    slack = [surplus if k in CABLES else 0.0 for k in range(8)]
    changes = [f"seed={seed}", f"perturbations.slack={slack}", f"tension_management={WAYS[way]}"]
    result = ServoRun(load_scenario(SLACK_SCENARIO, [*SLACK_CHANGES, *changes])).simulate()
    log = result.log
    rows = np.flatnonzero(np.any(log["surplus_lengths"][:, CABLES] > TAUT, axis=1))
    apart = np.linalg.norm(log["X_WP"][:, 4:] - log["X_WP_estimated"][:, 4:], axis=1)
    errors = image_errors(result, seed)
    finite = errors[np.isfinite(errors)]
    return {
        "taut_s": log["time"][rows[-1]] if len(rows) else 0.0,
        "fastest_m_s": np.max(-log["tension_corrections"]),
        "estimate_m": np.max(apart),
        "seen_error_m": np.mean(np.abs(finite)) if len(finite) else np.nan,
        "seen_bias_m": np.mean(finite) if len(finite) else np.nan,
        "seen_share": len(finite) / len(errors) if len(errors) else np.nan,
    }


def image_errors(result: ServoRun, seed: int) -> Array:
    """Errors of the slack that the robot's camera in the world sees in the rows of a log, for
    cables that are slack, shape (n,) [m]; NaN if it does not see it."""
    log, servo = result.log, result.built
    robot, cables = servo.robot, servo.believed.cables.without_pulleys()
    mount = robot.camera_mount("overview")
    lens = load_camera(mount.model)
    pinhole, X_WE = lens.pinhole(lens.width, lens.height), mount.pose.transform()
    true = CompiledCableRobot(robot, servo.scenario).forces
    camera = CableCamera(
        true.cable_set(), true.model(), X_WE, pinhole, SLACK_RATE,
        points=POINTS, noise=NOISE, seed=seed,
    )  # fmt: skip
    errors = list[float]()
    surpluses = log["surplus_lengths"][:, CABLES]
    for k in np.flatnonzero(np.any(surpluses > TAUT, axis=1)):
        pixels = camera.look(pose_from_row(log["X_WP"][k]), log["unstrained_lengths"][k], int(k))
        try:
            image = slack_from_image(
                pixels.reshape(len(robot.cables), 2, -1), cables,
                pose_from_row(log["X_WP_estimated"][k]), X_WE, pinhole, NOISE,
            )  # fmt: skip
        except CableGeometryError:
            continue
        errors += (image.surplus[CABLES] - surpluses[k])[surpluses[k] > TAUT].tolist()
    return np.array(errors)


def cases(form: Form) -> Iterator[Case]:
    """All of them, or a few in the quick form, which end under way, and a start with slack."""
    seeds = form.times(10)
    duration = QUICK_DURATION if form.quick else DURATION
    for name in THREE if form.quick else CONFIGURATIONS:
        words, changes = CONFIGURATIONS[name]
        keys = {"trial": SERVO, "configuration": name, "sources": words, "duration_s": duration}
        yield Case(keys=keys, call=partial(servo_row, changes, duration), seeds=seeds)
    for way in ["image"] if form.quick else WAYS:
        for surplus in SURPLUSES[:1] if form.quick else SURPLUSES:
            keys = {"trial": SLACK, "way": way, "surplus_m": surplus}
            yield Case(keys=keys, call=partial(slack_row, way, surplus), seeds=seeds)


# What facts ask of several runs.


def both_as_good_as_the_better(rows: Frame) -> tuple[list[bool], str]:
    """Mean error with both cameras beside that of the one that is better over all seeds.

    Which of them is the better for a single seed nobody knows beforehand. What the filter expects
    is told, but does not count: with more readings it always expects less.
    """
    runs = {name: select(rows, configuration=name) for name in THREE}
    errors = Frame({name: mine["mean_m"].to_numpy() for name, mine in runs.items()})
    if len(errors) < 2:
        raise MissingRuns("a second seed, as one has no spread")
    cameras = errors[["on_board", "external"]]
    more = errors["both"] - errors[cameras.mean().idxmin()]
    mean, chance = more.mean(), 2.0 * more.std() / np.sqrt(len(more))
    luckier = errors["both"] / cameras.min(axis=1)
    means = ", ".join(
        f"{name} {1e3 * np.mean(errors[name]):.1f} mm (expected "
        f"{1e3 * mine['expected_m'].mean():.1f} mm)"
        for name, mine in runs.items()
    )
    return [bool(mean <= 0.0), bool(mean <= chance)], (
        f"mean error of the pose over {len(more)} seeds: {means}; both less the better one "
        f"{1e3 * mean:+.1f} mm, by chance up to {1e3 * chance:.1f}; over the luckier one of each "
        f"seed {luckier.median():.2f} (median), {luckier.max():.2f} at most"
    )


def consistent(rows: Frame) -> tuple[list[bool], str]:
    """Whether normalized errors of six numbers are 6 in the mean, as far as so many tell."""
    names = (*THREE, "both, doubted", "both, external knocked, doubted",
             "both, on_board wrong, told", "both, external wrong, told")  # fmt: skip
    nees = {name: select(rows, configuration=name)["nees"] for name in names}
    away = 4.0 * np.sqrt(12.0 / len(nees["both"]))
    words = "; ".join(f"{name} {ends.mean():.1f}" for name, ends in nees.items())
    held = [bool(abs(ends.mean() - 6.0) <= away) for ends in nees.values()]
    return held, f"at the end, {words}; within {away:.1f} for so many runs"


# What is shown.


def servo_table(rows: Frame) -> Frame:
    """Means over seeds and the worst of them."""
    columns = {
        "at the target": ("servo_m", "mm"), "estimate at the end": ("final_m", "mm"),
        "mean": ("mean_m", "mm"), "mean turn": ("mean_rad", "deg"),
        "largest": ("largest_m", "mm"), "NEES": ("nees", "-"),
    }  # fmt: skip
    cells = {
        f"{words}{ending} [{unit}]": (column, how)
        for words, (column, unit) in columns.items()
        for ending, how in (("", "mean"), (", worst", "max"))
    }
    left_out = {"world left out [%]": ("external_left_out", "mean")}
    return summary(select(rows, trial=SERVO), "sources", {**cells, **left_out})


def slack_table(rows: Frame) -> Frame:
    """Means over seeds."""
    return summary(select(rows, trial=SLACK), ["way", "surplus_m"], {
        "taut after [s]": ("taut_s", "mean"), "fastest [m/s]": ("fastest_m_s", "mean"),
        "estimate [mm]": ("estimate_m", "mean"), "image wrong by [mm]": ("seen_error_m", "mean"),
        "its bias [mm]": ("seen_bias_m", "mean"), "in the image [%]": ("seen_share", "mean"),
    })  # fmt: skip


def figure(rows: Frame) -> Figure:
    """Errors of the estimate in time and of every configuration, consistency."""
    servos = rows[rows["trial"] == SERVO]
    drawn, axes = new_figure(2, 2, (15.0, 11.0), "Two cameras, lengths, an IMU and depths, fused")
    estimates, covered, errors, consistency = axes.flat
    apart = "distance from the true pose [mm]"
    names = ("on_board covered", "both, on_board covered", "both, external covered")
    for panel, configurations, curve, scale, ylabel, title in (
        (estimates, THREE, "estimate_m", 1e3, apart, "pose estimate, mean over seeds"),
        (covered, names, "estimate_m", 1e3, apart, "a camera covered from 2 to 5 s"),
        (consistency, THREE, "nees_by_row", 1.0, "normalized error squared [-]", "consistency"),
    ):
        for number, name in enumerate(configurations):
            runs = servos[servos["configuration"] == name]
            if len(runs):
                values = scale * np.mean([arrays[curve] for arrays in runs["arrays"]], axis=0)
                panel.plot(np.arange(len(values)) / RATE, values, label=runs["sources"].iloc[0],
                           **line_style(nth_look(number)))  # fmt: skip
        panel.set(xlabel="time [s]", ylabel=ylabel, title=title)
    consistency.axhline(6.0, label="as uncertain as wrong", **line_style(BOUND))
    consistency.margins(y=0.1)
    if covered.lines:
        covered.axvspan(2.0, 5.0, color=SHADED.color, linewidth=0.0)
    else:
        covered.remove()
    means = servos.groupby("sources", sort=False)["mean_m"].mean()
    errors.barh(range(len(means)), 1e3 * means, 0.6, label="mean", **bar_style(nth_look(0)))
    errors.plot(1e3 * servos["largest_m"], servos["sources"].map(means.index.get_loc), "x",
                color=nth_look(7).color, label="largest, each run")  # fmt: skip
    errors.set_yticks(range(len(means)), means.index, fontsize=8)
    errors.invert_yaxis()
    errors.set(xlabel="distance of the estimate from the true pose [mm]",
               title="all configurations")  # fmt: skip
    for panel in drawn.axes:
        if panel is not errors:
            panel.set_ylim(bottom=0.0)
        panel.legend(loc="best")
    return drawn


STUDY = Study(
    name="fusion",
    title="Two cameras, lengths, an IMU and depths fused, each failing or wrong in its turn",
    source="servoing thesis, perspectives",
    cases=cases,
    coarse=True,
    parameters=lambda form: {"scenario": dump_typed(load_scenario(SCENARIO))},
    assumptions=(
        "Nothing of this is printed but that it could be done. Where the tag on the platform is, "
        "its size, the noise of 0.3 px and that the camera in the world is one image late are "
        "chosen.",
        "What is believed wrongly is drawn normally for each seed, by what the filter is told: the "
        "start by 5 mm and 0.5 deg on each axis, the camera on board by 3 mm and 0.3 deg, that in "
        "the world by 3 mm and 0.2 deg, the target's place by 10 mm and 1 deg. A camera that is "
        "wrong by 2 cm and 1 deg is so in a drawn direction on top of that; the filter is not "
        "told, unless a configuration says so: then that camera is worse with probability 0.5, by "
        "12 mm and 0.6 deg on each axis; where both are doubted, each with 0.05, by 20 mm and 1 "
        "deg.",
        "Encoders and tension sensors are ideal and read by every configuration.",
        "Slack is that of case study IX, E3, E5 and E9, on cables 1 and 2, with a projected "
        "camera; believed wrongly are exit and anchor points by 5 mm, the start by 2 mm and 0.2 "
        "deg. A cable in the image is 15 points with a noise of 0.5 px; nothing hides it.",
        "The IMU is the ADIS16448, the depth camera in the world a Kinect.",
    ),
    moments={"servo_m": "end", "mean_m": "mean", "mean_rad": "mean"},
    finds={"both_as_good_as_the_better": both_as_good_as_the_better, "consistent": consistent},
    tables={
        "Fusion of sensors, means over seeds, and the worst": servo_table,
        "Two cables slack at the start, means over seeds": slack_table,
    },
    figures={"fusion": figure},
)
