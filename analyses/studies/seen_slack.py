"""Study: slack cables found in rendered images, beside the truth.

ACROBOT hangs at poses all over its workspace, with each cable by chance straight or with a length
paid out beyond its way. The camera in the world that overlooks it draws the scene with the cables
as they hang, with grain; `vision.cable_detection` finds each of them, how far it sags and how well
that is known. Knowledge of the pose:

* exact: cables end where they are believed to;
* off: the believed pose is off by about a millimetre and a tenth of a degree, as estimators are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from pydrake.math import RigidTransform

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, Finding, statement
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import Cell, Summary
from cdpr_drake.analyses.visualization.figure_style import new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import exponential, pose_from_angles
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.rendered_camera import add_renderer
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import nth_look
from cdpr_drake.systems.cameras.cable_picture_camera import CablePicture
from cdpr_drake.systems.diagrams.camera import pictured_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.vision.cable_detection import (
    SLACK,
    TAUT,
    UNSEEN,
    SeenSags,
    SightSettings,
    find_sags,
)
from cdpr_drake.vision.cable_images import sag_of_surplus

ROBOT, MOUNT = "acrobot_small", "overview"

EXACT, OFF = "exact", "off"

ERRORS = {EXACT: (0.0, 0.0), OFF: (0.8e-3, 0.1)}
"""Standard deviations of each coordinate of the believed pose, drawn and told [m] and [deg]."""

POINTS = 2e-5
"""Standard deviation of each coordinate of exit and anchor points as told [m]; they are exact."""

LOWER, UPPER = (-0.2, -0.2, 0.2), (0.2, 0.2, 0.6)
"""Corners of the box of positions [m]."""

TILT = 10.0
"""Largest angles about each axis [deg]."""

SHORTEST, LONGEST = 1e-3, 0.04
"""Length beyond its way of a slack cable [m], drawn evenly by its logarithm."""

STRAIN = 1e-4
"""Length that a taut cable is shorter than its way, of that [-]."""

GRAIN = 2.0

POSES = (60, 3)

MOST_FALSE, LEAST_HITS = 0.01, 0.95
"""Shares that are accepted."""

SPREAD = (0.5, 1.5)
"""Mean square of errors over their standard deviations that is accepted [-]."""

FAR = 3.5
"""Standard deviations beyond which an error is told apart: one of 2000 normal numbers is."""

_STREAM = 409


def cases(_form: Form) -> Iterator[Case]:
    """Both kinds of knowledge."""
    for pose in (EXACT, OFF):
        yield Case(name=f"pose {pose}", keys={"pose": pose})


@lru_cache(maxsize=1)
def pictured() -> tuple[CableRobot, CablePicture]:
    """The robot that is drawn, and how."""
    robot = load_robot(ROBOT)
    block = pictured_robot(robot)
    add_renderer(block.scene_graph)
    mount = robot.camera_mount(MOUNT)
    camera = load_camera(mount.model)
    picture = CablePicture(
        cables=robot.cable_set(),
        model="elastic",
        radii=0.5 * robot.diameters(),
        world=block.plant.GetBodyFrameIdOrThrow(block.plant.world_body().index()),
        X_WE=mount.pose.transform(),
        pinhole=camera.pinhole(camera.width, camera.height),
        grain=GRAIN,
    )
    return block, picture


def drawn_pose(seed: int) -> tuple[RigidTransform, Array]:
    """Pose [m] of a seed and lengths of its cables beyond their ways, shape (m,) [m]."""
    random = np.random.default_rng([seed, _STREAM])
    X_WP = pose_from_angles(
        random.uniform(LOWER, UPPER), np.radians(random.uniform(-TILT, TILT, 3))
    )
    m = pictured()[1].cables.count
    longer = np.exp(random.uniform(np.log(SHORTEST), np.log(LONGEST), m))
    ways = cable_paths(X_WP, pictured()[1].cables).lengths
    return X_WP, np.where(random.random(m) < 0.5, longer, -STRAIN * ways)


def true_sags(cables: CableSet, X_WP: RigidTransform, surplus: Array) -> Array:
    """How far the middles of cables hang below the lines between their ends, shape (m,) [m]."""
    paths = cable_paths(X_WP, cables)
    rise = paths.free * paths.u_W
    return np.array([
        sag_of_surplus(max(s, 0.0), float(np.hypot(r[0], r[1])), float(r[2]))
        for s, r in zip(surplus, rise.T, strict=True)
    ])  # fmt: skip


def seen(seed: int, knowledge: str) -> tuple[np.ndarray, SeenSags, Array]:
    """The image of a seed's pose, what is found in it, and true sags, shape (m,) [m]."""
    block, picture = pictured()
    X_WP, surplus = drawn_pose(seed)
    context = block.CreateDefaultContext()
    block.in_plant.set_pose(block.plant.GetMyMutableContextFromRoot(context), X_WP)
    query = block.GetOutputPort("query_object").Eval(context)
    lengths = cable_paths(X_WP, picture.cables).lengths + surplus
    image = picture.draw(query, X_WP, lengths, seed)
    metres, degrees = ERRORS[knowledge]
    wrong = np.random.default_rng([seed, _STREAM + 1]).standard_normal(6)
    deviations = np.repeat([np.radians(degrees), metres], 3)
    found = find_sags(
        image, picture.cables, X_WP @ exponential(wrong * deviations), picture.X_WE,
        picture.pinhole, SightSettings(ends=POINTS), pose_covariance=np.diag(deviations**2),
    )  # fmt: skip
    return image, found, true_sags(picture.cables, X_WP, surplus)


def measure(case: Case, seed: int) -> dict[str, Any]:
    """An image.

    Returns:
        slack, taut: how many cables are; hits: slack ones that are found slack; false_slack: taut
        ones that are; unseen: cables on which nothing is said, and unseen_slack of them; errors_m
        and sigmas_m of the sags that are found; squares: mean square of their ratios.
    """
    _, found, true = seen(seed, case.keys["pose"])
    slack, there = true > 0.0, found.verdict != UNSEEN
    errors, sigmas = (found.sag - true)[there], found.sigma[there]
    return {
        "slack": int(np.sum(slack)),
        "taut": int(np.sum(~slack)),
        "hits": int(np.sum(slack & (found.verdict == SLACK))),
        "false_slack": int(np.sum(~slack & (found.verdict == SLACK))),
        "unseen": int(np.sum(~there)),
        "unseen_slack": int(np.sum(slack & ~there)),
        "rms_m": float(np.sqrt(np.mean(errors**2))),
        "largest_m": float(np.max(np.abs(errors))),
        "squares": float(np.mean((errors / sigmas) ** 2)),
        "largest_sigmas": float(np.max(np.abs(errors / sigmas))),
    }


@statement("Slack cables that are seen are found slack, 95 of 100.", basis=OURS)
def hits(runs: Runs) -> Finding:
    """All cables, by knowledge of the pose."""
    words, held = [], []
    for pose, some in runs.by("pose"):
        of_seen = int(np.sum(some["slack"]) - np.sum(some["unseen_slack"]))
        found = int(np.sum(some["hits"]))
        words.append(
            f"pose {pose}: {found} of {of_seen} seen, {int(np.sum(some['unseen_slack']))} unseen"
        )
        held.append(found >= LEAST_HITS * of_seen)
    return Finding(found="; ".join(words), held=held)


@statement("Of taut cables at most one in a hundred is found slack.", basis=OURS)
def false(runs: Runs) -> Finding:
    """All cables, by knowledge of the pose."""
    words, held = [], []
    for pose, some in runs.by("pose"):
        found, taut = int(np.sum(some["false_slack"])), int(np.sum(some["taut"]))
        words.append(f"pose {pose}: {found} of {taut}")
        held.append(found <= MOST_FALSE * taut)
    return Finding(found="; ".join(words), held=held)


@statement(
    "Sags are as well known as the fit says: mean squares of errors in deviations.", basis=OURS
)
def spread(runs: Runs) -> Finding:
    """All cables that are seen, by knowledge of the pose."""
    words, held = [], []
    for pose, some in runs.by("pose"):
        counts = some["slack"] + some["taut"] - some["unseen"]
        total, worst = float(np.sum(counts * some["squares"])), some["largest_sigmas"]
        mean, far = total / float(np.sum(counts)), worst > FAR
        rest = (total - float(np.sum(worst[far] ** 2))) / float(np.sum(counts) - np.sum(far))
        words.append(
            f"pose {pose}: {mean:.2f}, largest {float(np.max(some['largest_sigmas'])):.1f} "
            f"deviations; without the worst cable of the {int(np.sum(far))} images that have one "
            f"beyond {FAR:g}: {rest:.2f}"
        )
        held.append(SPREAD[0] <= mean <= SPREAD[1])
    return Finding(
        found="; ".join(words),
        held=held,
        why="Errors have a longer tail than normal ones: a few cables make the mean.",
    )


def draw_found(axis: Axes, seed: int) -> None:
    """An image with what is found in it, cut to where cables are; slack ones with their sags."""
    image, found, true = seen(seed, EXACT)
    axis.imshow(image)
    everywhere = np.hstack(found.points)
    labels = {TAUT: "on a taut cable", SLACK: "on a slack cable, sag found (true)"}
    for verdict, words in labels.items():
        look = nth_look(verdict)
        chosen = [
            uv for uv, said in zip(found.points, found.verdict, strict=True) if said == verdict
        ]
        if chosen:
            axis.plot(
                *np.hstack(chosen), "x" if verdict == SLACK else ".", color=look.color,
                markersize=4.0 if verdict == SLACK else 2.0, linestyle="none", label=words,
            )  # fmt: skip
    for k in np.flatnonzero(found.verdict == SLACK):
        uv = found.points[k]
        third = uv[:, uv.shape[1] // 3].tolist()
        axis.annotate(
            f"{1e3 * found.sag[k]:.1f} mm ({1e3 * true[k]:.1f})", tuple(third),
            fontsize=9, xytext=(8, -2), textcoords="offset points",
        )  # fmt: skip
    low, high = np.min(everywhere, axis=1) - 15.0, np.max(everywhere, axis=1) + 45.0
    axis.set(xlabel="u [px]", ylabel="v [px]", xlim=(low[0], high[0]), ylim=(high[1], low[1]))
    axis.grid(visible=False)
    axis.legend(loc="lower left")


def figure(runs: Runs) -> Figure:
    """An image with what is found in it, and errors of all."""
    drawn, axes = new_figure(1, 2, (14.0, 5.4), "Cables found in a rendered image, and their sags")
    draw_found(axes[0], int(runs["seed"][0]))
    for k, (pose, some) in enumerate(runs.by("pose")):
        look = nth_look(k)
        axes[1].plot(
            some["seed"], 1e3 * some["rms_m"], look.marker or "o", color=look.color,
            markerfacecolor="none", linestyle="none", label=f"pose {pose}",
        )  # fmt: skip
    axes[1].set(xlabel="pose (seed)", ylabel="rms error of sags [mm]", ylim=(0.0, None))
    axes[1].xaxis.set_major_locator(MaxNLocator(integer=True))
    axes[1].legend(loc="best")
    return drawn


def parameters(_form: Form) -> Mapping[str, Any]:
    """What all images have in common."""
    return {
        "robot": ROBOT, "mount": MOUNT, "errors": ERRORS, "points_m": POINTS,
        "lower_m": LOWER, "upper_m": UPPER,
        "tilt_deg": TILT, "surplus_m": (SHORTEST, LONGEST), "grain": GRAIN,
    }  # fmt: skip


STUDY = Study(
    name="seen-slack",
    title="Slack cables found in rendered images: hits, false alarms, and how far they sag",
    cases=cases,
    measure=measure,
    seeds=POSES,
    parameters=parameters,
    checks=(hits, false, spread),
    tables=[
        Summary(
            "Cables by knowledge of the pose",
            ("pose",),
            {
                "images": Cell("runs"),
                "slack": Cell("total", "slack"),
                "found slack": Cell("total", "hits"),
                "taut": Cell("total", "taut"),
                "of these found slack": Cell("total", "false_slack"),
                "unseen": Cell("total", "unseen"),
                "error of sag, rms, median [mm]": Cell("median", "rms_m", ".3f"),
                "largest [mm]": Cell("largest", "largest_m", ".2f"),
                "largest in deviations": Cell("largest", "largest_sigmas", ".1f"),
            },
        )
    ],
    figures={"seen_slack": figure},
)
