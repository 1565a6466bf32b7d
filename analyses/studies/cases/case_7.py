"""Case study VII: planning and tracking the path of the features, on ACROBOT."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.reporting import Statement, verdict
from cdpr_drake.analyses.studies.cases.definition import PULLEYS, CaseStudy, Configuration
from cdpr_drake.analyses.studies.cases.pose_offsets import (
    as_transform,
    camera_belief,
    pose_item,
    turned,
)
from cdpr_drake.analyses.studies.cases.run import CaseRuns
from cdpr_drake.analyses.studies.cases.statements import same_accuracy

START = as_transform(((0.107, -0.026, 0.35), (20.0, -20.0, 0.0)))
"""Initial pose of the platform in W."""

X_PC = as_transform(((-0.0631, 0.0, 0.01), (0.0, 180.0, 0.0)))
"""True pose of the camera on the small platform."""

SETUP = (
    "controller.scheme=2.5d",
    "controller.rate=20",
    "camera.rate=20",
    "controller.lambda_0=2.0",
    "controller.lambda_infinity=0.4",
    "controller.lambda_slope=30",
    "controller.sigma=4.0",
    pose_item("initial_pose", START),
    "desired={position: [0, 0, 0.09], angles_deg: [180, 0, 180]}",
    "target.pose={position: [0.2369, 0.25, 0.04]}",
)

TIME = 12.0
"""Time for which the path of the features is planned [s]: about what the servo takes without."""

TRACKING = (f"trajectory={{duration: {TIME:g}}}", "controller.lambda_infinity=2.0")


def _belief(distance: float, angle_deg: float, axis: tuple[float, float, float]) -> tuple[str, str]:
    X = turned(START, np.zeros(3), angle_deg, np.array(axis))
    return (
        pose_item("perturbations.initial_pose", X),
        f"perturbations.initial_pose_shift={{distance: {distance:g}}}",
    )


def _camera(angle_deg: float, axis: tuple[float, float, float]) -> str:
    return camera_belief(X_PC, turned(X_PC, np.zeros(3), angle_deg, np.array(axis)))


def _camera_place(distance: float) -> str:
    return f"perturbations.camera_pose_shift={{distance: {distance:g}}}"


def _points(distance: float) -> tuple[str, str]:
    return (
        f"perturbations.exit_points={distance:g}",
        f"perturbations.anchor_points={distance:g}",
    )


def _belief_of_d1() -> str:
    X = as_transform(((0.0, -0.15, 0.25), (15.0, -25.0, 3.0)))
    return pose_item("perturbations.initial_pose", X)


SETS: dict[str, tuple[str, ...]] = {
    "none": (),
    "d1": (_belief_of_d1(), _camera(18.0, (0.61, -0.51, -0.61))),
    "d2": (
        *_belief(0.13, 9.5, (-0.52, 0.85, -0.04)),
        _camera(12.5, (0.78, -0.51, -0.35)),
        _camera_place(0.05),
        *_points(0.005),
    ),
    "d3": (
        *_belief(0.075, 8.0, (0.6, 0.78, -0.15)),
        _camera(18.0, (0.15, -0.63, 0.76)),
        _camera_place(0.05),
        *_points(0.01),
    ),
    "d4": (
        *_belief(0.11, 6.0, (-0.49, -0.5, 0.71)),
        _camera(15.0, (-0.47, -0.65, -0.60)),
    ),
}
"""Perturbation sets of section 4.3.1."""


def _pairs() -> tuple[Configuration, ...]:
    made = []
    for name, changes in SETS.items():
        words = "no perturbation" if name == "none" else name
        clean = {"image_max_px": "10", "camera_max_m": "10"} if name == "none" else {}
        shown = {} if name == "none" else {"image_max_px": "18 or less"}
        made += [
            Configuration(f"{name}_servo", f"{words}, 2 1/2 D", changes, published=clean),
            Configuration(
                f"{name}_tracking",
                f"{words}, tracking",
                (*changes, *TRACKING),
                published=clean or shown,
            ),
        ]
    return tuple(made)


def _ratio(runs: CaseRuns, name: str, metric: str) -> float:
    return runs.mean(f"{name}_servo", metric) / runs.mean(f"{name}_tracking", metric)


def _better(runs: CaseRuns) -> Statement:
    names = ("d1", "d2", "d3", "d4")
    image = [_ratio(runs, name, "image_max_px") for name in names]
    camera = [_ratio(runs, name, "camera_max_m") for name in names]
    return Statement(
        "With tracking, the deviations under d1 to d4 are two to three times smaller, or better.",
        "figure 4.6",
        "image "
        + ", ".join(f"{r:.1f}" for r in image)
        + " times, camera "
        + ", ".join(f"{r:.1f}" for r in camera)
        + " times smaller",
        verdict(min(image + camera) >= 2.0, max(min(image), min(camera)) >= 2.0),
    )


def _same_without(runs: CaseRuns) -> Statement:
    image = [runs.largest(f"none_{kind}", "image_max_px") for kind in ("servo", "tracking")]
    camera = [1e3 * runs.largest(f"none_{kind}", "camera_max_m") for kind in ("servo", "tracking")]
    return Statement(
        "Without perturbation, both stay close to the straight lines.",
        "at most 10 px and 10 mm",
        f"at most {image[0]:.1f} and {image[1]:.1f} px, {camera[0]:.1f} and {camera[1]:.1f} mm",
        verdict(max(image) <= 10.0 and max(camera) <= 10.0, min(image) <= 10.0),
    )


def _space(runs: CaseRuns) -> Statement:
    found = [1e3 * runs.mean(f"{name}_tracking", "camera_max_m") for name in SETS]
    return Statement(
        "With tracking, the camera's path stays about as without perturbation, whatever the set.",
        "figures 4.4c, 4.5c",
        ", ".join(f"{name} {value:.1f}" for name, value in zip(SETS, found, strict=True)) + " mm",
        verdict(max(found) < 2.0 * found[0], max(found) < 10.0),
    )


def _accuracy(runs: CaseRuns) -> Statement:
    return same_accuracy(runs, [c.name for c in CASE_7.configurations], "chapter 4")


CASE_7 = CaseStudy(
    name="case-7",
    title="Trajectory planning and tracking on ACROBOT",
    source="servoing thesis 4.3, figures 4.3 to 4.6",
    scenario="acrobot_pbvs",
    changes=(*SETUP, PULLEYS),
    configurations=_pairs(),
    repetitions=15,
    rendered=("none_tracking", "d2_tracking"),
    quick=("d1_servo", "d1_tracking"),
    assumptions=(
        "The tag is put where the printed desired poses put it, 0.04 m above the ground.",
        "Axes of rotations are in W for the platform and in P for the camera, and the turn leads "
        "from the belief to the truth: the printed assumed pose of d1 says so.",
        "Directions of the shifts of platform, camera and points are not printed, but for d1; each "
        "run draws its own from its seed.",
        f"The way is planned for {TIME:g} s; the thesis takes the time of the run without.",
        "Controller and camera run at 20 Hz, the printed time step of 0.05 s.",
    ),
    judges=(_better, _same_without, _space, _accuracy),
)
