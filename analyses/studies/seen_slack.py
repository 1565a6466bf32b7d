"""Study: slack cables found in rendered images, beside the truth.

ACROBOT hangs at poses all over its workspace, with each cable by chance straight or with a length
paid out beyond its way. The camera in the world that overlooks it draws the scene with the cables
as they hang, with grain; `vision.cable_detection` finds each of them, how far it sags and how well
that is known. Cables end where they are believed to if the pose is exact; off by about a millimetre
and a tenth of a degree, as estimators are, if it is not.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache, partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from pydrake.math import RigidTransform
from pydrake.systems.framework import Diagram, DiagramBuilder

from cdpr_drake.analyses.frame.figures import new_figure
from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study, summary
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import exponential, pose_from_angles
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.rendered_camera import add_renderer
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import nth_look
from cdpr_drake.systems.cameras.cable_picture_camera import CablePicture
from cdpr_drake.systems.diagrams.camera import PicturedRobot, add_pictured_robot
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

ERRORS = {"exact": (0.0, 0.0), "off": (0.8e-3, 0.1)}
"""Standard deviations of each coordinate of the believed pose, drawn and told [m] and [deg]."""

ENDS = 2e-5
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

FAR = 3.5
"""Standard deviations beyond which an error is told apart: one of 2000 normal numbers is."""

STREAM = 409
"""Of random numbers, beside the seed."""


@lru_cache(maxsize=1)
def pictured() -> tuple[Diagram, PicturedRobot, CablePicture]:
    """The robot that is drawn, in its diagram, and how."""
    robot, builder = load_robot(ROBOT), DiagramBuilder()
    block = add_pictured_robot(builder, robot)
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
    return builder.Build(), block, picture


def drawn_pose(seed: int) -> tuple[RigidTransform, Array]:
    """Pose [m] of a seed and lengths of its cables beyond their ways, shape (m,) [m]."""
    random, cables = np.random.default_rng([seed, STREAM]), pictured()[2].cables
    X_WP = pose_from_angles(
        random.uniform(LOWER, UPPER), np.radians(random.uniform(-TILT, TILT, 3))
    )
    longer = np.exp(random.uniform(np.log(SHORTEST), np.log(LONGEST), cables.count))
    taut = -STRAIN * cable_paths(X_WP, cables).lengths
    return X_WP, np.where(random.random(cables.count) < 0.5, longer, taut)


def true_sags(cables: CableSet, X_WP: RigidTransform, surplus: Array) -> Array:
    """How far the middles of cables hang below the lines between their ends, shape (m,) [m]."""
    paths = cable_paths(X_WP, cables)
    rise = paths.free * paths.u_W
    return np.array([
        sag_of_surplus(max(s, 0.0), float(np.hypot(r[0], r[1])), float(r[2]))
        for s, r in zip(surplus, rise.T, strict=True)
    ])  # fmt: skip


def detected(seed: int, knowledge: str) -> tuple[np.ndarray, SeenSags, Array]:
    """The image of a seed's pose, what is detected in it, and true sags, shape (m,) [m]."""
    diagram, block, picture = pictured()
    X_WP, surplus = drawn_pose(seed)
    context = diagram.CreateDefaultContext()
    block.in_plant.set_pose(block.plant.GetMyMutableContextFromRoot(context), X_WP)
    query = block.GetOutputPort("query_object").Eval(
        block.scene_graph.GetMyContextFromRoot(context)
    )
    lengths = cable_paths(X_WP, picture.cables).lengths + surplus
    image = picture.draw(query, X_WP, lengths, seed)
    metres, degrees = ERRORS[knowledge]
    wrong = np.random.default_rng([seed, STREAM + 1]).standard_normal(6)
    deviations = np.repeat([np.radians(degrees), metres], 3)
    sags = find_sags(
        image, picture.cables, X_WP @ exponential(wrong * deviations), picture.X_WE,
        picture.pinhole, SightSettings(ends=ENDS), pose_covariance=np.diag(deviations**2),
    )  # fmt: skip
    return image, sags, true_sags(picture.cables, X_WP, surplus)


def image_row(knowledge: str, seed: int) -> dict[str, Any]:
    """An image.

    Returns:
        slack, taut: how many cables are; hits: slack ones that are found slack; false_slack: taut
        ones that are; unseen: cables on which nothing is said, and unseen_slack of them; rms_m,
        largest_m: errors of the sags that are found; squares, largest_sigmas: mean square and
        largest of their ratios to standard deviations [-].
    """
    _, sags, true = detected(seed, knowledge)
    slack, judged = true > 0.0, sags.verdict != UNSEEN
    errors, sigmas = (sags.sag - true)[judged], sags.sigma[judged]
    return {
        "slack": int(np.sum(slack)),
        "taut": int(np.sum(~slack)),
        "hits": int(np.sum(slack & (sags.verdict == SLACK))),
        "false_slack": int(np.sum(~slack & (sags.verdict == SLACK))),
        "unseen": int(np.sum(~judged)),
        "unseen_slack": int(np.sum(slack & ~judged)),
        "rms_m": float(np.sqrt(np.mean(errors**2))),
        "largest_m": float(np.max(np.abs(errors))),
        "squares": float(np.mean((errors / sigmas) ** 2)),
        "largest_sigmas": float(np.max(np.abs(errors / sigmas))),
    }


def cases(form: Form) -> Iterator[Case]:
    """Both kinds of knowledge of the pose."""
    for pose in ERRORS:
        yield Case(keys={"pose": pose}, call=partial(image_row, pose), seeds=form.times(60, 3))


def spread(rows: Frame) -> tuple[list[bool], str]:
    """Mean squares of errors in deviations, over all cables that are seen."""
    held, words = [], []
    for pose, images in rows.groupby("pose", sort=False):
        count = images["slack"] + images["taut"] - images["unseen"]
        total, worst = float((count * images["squares"]).sum()), images["largest_sigmas"]
        mean, far = total / count.sum(), worst > FAR
        rest = (total - (worst[far] ** 2).sum()) / (count.sum() - far.sum())
        held.append(bool(0.5 <= mean <= 1.5))
        words.append(
            f"pose {pose}: {mean:.2f}, largest {worst.max():.1f} deviations; without the worst "
            f"cable of the {far.sum()} images that have one beyond {FAR:g}: {rest:.2f}"
        )
    return held, "; ".join(words)


def table(rows: Frame) -> Frame:
    """Cables by knowledge of the pose."""
    return summary(rows, "pose", {
        "images": ("seed", "size"), "slack": ("slack", "sum"), "found slack": ("hits", "sum"),
        "taut": ("taut", "sum"), "of these found slack": ("false_slack", "sum"),
        "unseen": ("unseen", "sum"), "error of sag, rms, median [mm]": ("rms_m", "median"),
        "largest [mm]": ("largest_m", "max"), "largest in deviations": ("largest_sigmas", "max"),
    })  # fmt: skip


def draw_detected(axis: Axes, seed: int) -> None:
    """An image with what is detected in it, cut to where cables are; slack ones with their sags."""
    image, sags, true = detected(seed, "exact")
    axis.imshow(image)
    labels = {TAUT: "on a taut cable", SLACK: "on a slack cable, sag found (true)"}
    for verdict, words in labels.items():
        points = [uv for uv, own in zip(sags.points, sags.verdict, strict=True) if own == verdict]
        if points:
            axis.plot(
                *np.hstack(points), "x" if verdict == SLACK else ".", color=nth_look(verdict).color,
                markersize=4.0 if verdict == SLACK else 2.0, linestyle="none", label=words,
            )  # fmt: skip
    for k in np.flatnonzero(sags.verdict == SLACK):
        uv = sags.points[k]
        third = uv[:, uv.shape[1] // 3].tolist()
        axis.annotate(
            f"{1e3 * sags.sag[k]:.1f} mm ({1e3 * true[k]:.1f})", tuple(third),
            fontsize=9, xytext=(8, -2), textcoords="offset points",
        )  # fmt: skip
    everywhere = np.hstack(sags.points)
    low, high = np.min(everywhere, axis=1) - 15.0, np.max(everywhere, axis=1) + 45.0
    axis.set(xlabel="u [px]", ylabel="v [px]", xlim=(low[0], high[0]), ylim=(high[1], low[1]))
    axis.grid(visible=False)
    axis.legend(loc="lower left")


def figure(rows: Frame) -> Figure:
    """An image with what is detected in it, and errors of all."""
    drawn, axes = new_figure(1, 2, (14.0, 5.4), "Cables found in a rendered image, and their sags")
    draw_detected(axes[0], int(rows["seed"].iloc[0]))
    for k, (pose, images) in enumerate(rows.groupby("pose", sort=False)):
        look = nth_look(k)
        axes[1].plot(
            images["seed"], 1e3 * images["rms_m"], look.marker or "o", color=look.color,
            markerfacecolor="none", linestyle="none", label=f"pose {pose}",
        )  # fmt: skip
    axes[1].set(xlabel="pose (seed)", ylabel="rms error of sags [mm]", ylim=(0.0, None))
    axes[1].xaxis.set_major_locator(MaxNLocator(integer=True))
    axes[1].legend(loc="best")
    return drawn


STUDY = Study(
    name="seen-slack",
    title="Slack cables found in rendered images: hits, false alarms, and how far they sag",
    cases=cases,
    parameters=lambda form: {
        "robot": ROBOT, "mount": MOUNT, "errors": ERRORS, "points_m": ENDS, "lower_m": LOWER,
        "upper_m": UPPER, "tilt_deg": TILT, "surplus_m": (SHORTEST, LONGEST), "grain": GRAIN,
    },
    finds={"spread": spread},
    tables={"Cables by knowledge of the pose": table},
    figures={"seen_slack": figure},
)  # fmt: skip
