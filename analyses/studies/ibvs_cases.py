"""Studies: case VI and appendix A.6 of the servoing thesis, IBVS on ACROBOT with a wrong model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.studies.experiments import (
    DRAWN,
    X_PC,
    as_transform,
    camera_belief,
    pose_item,
)
from cdpr_drake.analyses.studies.servo import PULLEYS, Configuration, servo_study
from cdpr_drake.analyses.studies.servo_figures import (
    Panel,
    components,
    draw_corner_paths,
    each,
    layout,
    paths,
)
from cdpr_drake.arrays import Array

START = as_transform(((0.118, -0.104, 0.459), (16.0, 13.8, 20.6)))
"""Printed initial pose of the platform in W."""

EDGE = 0.0854
"""Edge of the square of points [m]."""

DEPTH = EDGE / 2.0 / 0.167
"""Desired distance of the points from the camera [m]: their printed desired coordinates are
+-0.167 at unit focal length."""

SERVO = (
    "controller.scheme=ibvs",
    "controller.lambda_0=1.0",
    "controller.lambda_infinity=0.2",
    "controller.lambda_slope=30",
    "target.kind=dots",
    f"target.size={EDGE}",
    "target.pose={position: [0.0735, -0.03, 0]}",
    pose_item("initial_pose", START),
    f"desired={{position: [0, 0, {DEPTH:.6g}], angles_deg: [180, 0, 180]}}",
    "duration=60",
    PULLEYS,
)

ASSUMPTIONS = (
    "The printed poses of the platform and the printed features do not fit each other. The pattern "
    "lies on the ground where the initial features and the initial pose put its middle; that also "
    "gives its size, and with the desired features the desired distance.",
    DRAWN,
    "Stop rules and sigma are those of case study I.",
)

NAMES = ("E1", "E2", "E3", "E4")


def shifted(name: str, distance: float, angle_deg: float) -> Configuration:
    """A first pose that is believed wrongly."""
    shift = f"perturbations.initial_pose_shift={{distance: {distance:g}, angle_deg: {angle_deg:g}}}"
    return Configuration(name, f"{name}: {distance:g} m, {angle_deg:g} deg", (shift,))


def camera_at(name: str, position: tuple[float, float, float]) -> Configuration:
    """A camera that is believed to be elsewhere on the platform."""
    belief = RigidTransform(X_PC.rotation(), np.array(position))
    wrong = np.linalg.norm(belief.translation() - X_PC.translation())
    label = f"{name}: camera {wrong:.3f} m wrong"
    return Configuration(f"camera_{name}", label, (camera_belief(X_PC, belief),), "camera")


def wrong_points(kind: str, name: str, distance: float) -> Configuration:
    """Points of cables that are believed wrongly, each in a direction of its own."""
    label = f"{name}: {kind} points {distance:g} m wrong"
    changes = (f"perturbations.{kind}_points={distance:g}",)
    return Configuration(f"{kind}_{name}", label, changes, f"{kind} points")


def line_length(curves: Mapping[str, Array]) -> dict[str, float]:
    """Length of the straight line that the pattern's middle should follow in the image [px]."""
    line = curves["image_line"]
    return {"image_line_px": float(np.linalg.norm(line[-1] - line[0]))}


def four_figures(chapter: str, first: int, of: Sequence[str], words: str) -> dict[str, Any]:
    """Paths in the image, errors, cable velocities and paths of the platform of E1, E2, ...

    As figures 3.41 to 3.44 and A.14 to A.25.
    """
    names = tuple(of)
    space = [[Panel(paths("platform_path"), names, "in the world frame W", space=True)]]
    rows = (
        ("paths of the four points in the image", each(draw_corner_paths, names, 2)),
        ("error e over time", each(components("error"), names, 2)),
        ("cable velocities over time", each(components("cable_velocities", 1e3), names, 2)),
        ("path of the platform", space),
    )
    return {
        f"figure_{chapter}_{first + k}": layout(
            f"Figure {chapter.upper()}.{first + k}: {words}, {about}", panels
        )
        for k, (about, panels) in enumerate(rows)
    }


CAMERAS = tuple(f"camera_{name}" for name in NAMES)
ANCHORS = ("camera_E1", "anchor_E2", "anchor_E3", "anchor_E4")
EXITS = ("camera_E1", "exit_E2", "exit_E3")

STUDIES = {
    "case-6": servo_study(
        name="case-6",
        title="IBVS on ACROBOT",
        source="servoing thesis 3.4.5, figures 3.41 to 3.44",
        scenario="acrobot_pbvs",
        changes=SERVO,
        configurations=(
            Configuration("E1", "E1: no perturbation"),
            shifted("E2", 0.08, 10.0),
            shifted("E3", 0.145, 19.0),
            shifted("E4", 0.28, 37.0),
        ),
        rendered=("E1",),
        assumptions=ASSUMPTIONS,
        figures=four_figures("3", 41, NAMES, "first pose wrong"),
    ),
    "case-a6": servo_study(
        name="case-a6",
        title="IBVS on ACROBOT with a wrong model",
        source="servoing thesis A.6, figures A.14 to A.25",
        scenario="acrobot_pbvs",
        changes=SERVO,
        configurations=(
            Configuration("camera_E1", "E1: no perturbation", group="camera"),
            camera_at("E2", (0.0, 0.0, 0.0)),
            camera_at("E3", (0.0631, 0.0, -0.01)),
            camera_at("E4", (0.0, -0.08, -0.02)),
            wrong_points("anchor", "E2", 0.038),
            wrong_points("anchor", "E3", 0.073),
            wrong_points("anchor", "E4", 0.108),
            wrong_points("exit", "E2", 0.032),
            wrong_points("exit", "E3", 0.103),
        ),
        rendered=("camera_E1",),
        metrics=line_length,
        columns=("image_line_px",),
        assumptions=ASSUMPTIONS,
        figures={
            **four_figures("a", 14, CAMERAS, "camera wrong"),
            **four_figures("a", 18, ANCHORS, "anchor points wrong"),
            **four_figures("a", 22, EXITS, "exit points wrong"),
        },
    ),
}
