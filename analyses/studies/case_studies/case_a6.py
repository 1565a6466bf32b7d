"""Appendix A.6: image-based visual servoing with a wrong camera position or wrong cable points."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.studies.case_studies.case_6 import ASSUMPTIONS, SETUP
from cdpr_drake.analyses.studies.case_studies.path_figures import four_layouts
from cdpr_drake.analyses.studies.framework.case_definition import PULLEYS, Configuration, Plan
from cdpr_drake.analyses.studies.framework.case_run import converged, outcomes
from cdpr_drake.analyses.studies.framework.case_statements import same_accuracy
from cdpr_drake.analyses.studies.framework.case_study import configuration_study
from cdpr_drake.analyses.studies.framework.experiments import X_PC, camera_belief
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import SOURCE, Finding, statement

POINTS = (
    "Each point is wrong in a direction of its own, which is not printed and drawn for each run."
)
"""Why runs cannot be those that were published."""

CAMERA = "camera"
ANCHORS = "anchor points"
EXITS = "exit points"


def _camera_at(name: str, position: tuple[float, float, float]) -> Configuration:
    belief = RigidTransform(X_PC.rotation(), np.array(position))
    wrong = np.linalg.norm(belief.translation() - X_PC.translation())
    return Configuration(
        f"camera_{name}",
        f"{name}: camera {wrong:.3f} m wrong",
        (camera_belief(X_PC, belief),),
        group=CAMERA,
        published={"outcome": "converged"},
    )


def _points(kind: str, name: str, distance: float, time: str = "") -> Configuration:
    group = ANCHORS if kind == "anchor" else EXITS
    published = {"outcome": "converged"}
    if time:
        published["time_s"] = time
    return Configuration(
        f"{kind}_{name}",
        f"{name}: {group} {distance:g} m wrong",
        (f"perturbations.{kind}_points={distance:g}",),
        group=group,
        published=published,
        why=f"each of the eight {group} is wrong in a direction of its own, drawn for each run; "
        "the printed runs had others",
    )


SMALL = 0.1
"""A path that is off its straight line by this share of the line's length more than without
perturbation shows a small effect."""


def line_length(runs: Runs, name: str) -> float:
    """Mean length of the straight line in the image of a configuration [px]."""
    lines = runs(configuration=name).list("image_line")
    return float(np.mean([np.linalg.norm(line[-1] - line[0]) for line in lines]))


@statement(
    "Any of the wrong camera positions leaves it stable, with a small effect.",
    "figures A.14 to A.17",
    rule=f"each run converges; each path is off its straight line by at most {SMALL:g} of the "
    "line's length more than in E1",
    cause=SOURCE,
    why="By how much the paths of A.14 are off is not printed, nor what else was wrong in E1.",
)
def _any_camera(runs: Runs) -> Finding:
    names = ("camera_E2", "camera_E3", "camera_E4")
    image = runs.means("image_max_px", configuration=names)
    without = runs.mean("image_max_px", configuration="camera_E1")
    lines = [line_length(runs, name) for name in names]
    return Finding(
        found="; ".join(f"{name[-2:]}: {outcomes(runs, name)}" for name in names)
        + f"; paths curve by {image[0]:.0f}, {image[1]:.0f}, {image[2]:.0f} px, in E1 by "
        f"{without:.0f} px; their lines are {lines[0]:.0f}, {lines[1]:.0f}, {lines[2]:.0f} px long",
        held=[
            *(converged(runs, name) for name in names),
            *(one - without <= SMALL * line for one, line in zip(image, lines, strict=True)),
        ],
        some=all(converged(runs, name) for name in names),
    )


@statement(
    "Wrong anchor points matter more than a wrong camera position.",
    "section A.6.2",
    cause=SOURCE,
    why=POINTS,
)
def _anchors_more_than_camera(runs: Runs) -> Finding:
    anchor, camera = runs.means("image_max_px", configuration=("anchor_E3", "camera_E2"))
    return Finding(
        found=f"paths curve by {anchor:.0f} px with anchor points 0.073 m wrong, {camera:.0f} px "
        "with the camera 0.064 m wrong",
        held=[anchor > camera],
    )


@statement(
    "Wrong anchor points matter more than wrong exit points.",
    "section A.6.3",
    cause=SOURCE,
    why=POINTS,
)
def _anchors_more_than_exits(runs: Runs) -> Finding:
    anchor, exits, near, far = runs.means(
        "image_max_px", configuration=("anchor_E4", "exit_E3", "anchor_E2", "exit_E2")
    )
    return Finding(
        found=f"paths curve by {anchor:.0f} px (anchor 0.108 m) against {exits:.0f} px (exit "
        f"0.103 m), {near:.0f} px (0.038 m) against {far:.0f} px (0.032 m)",
        held=[anchor > exits, near > far],
    )


@statement(
    "The more the anchor points are wrong, the more the paths curve.",
    "figures A.18, A.21",
    cause=SOURCE,
)
def _grows(runs: Runs) -> Finding:
    names = ("anchor_E2", "anchor_E3", "anchor_E4")
    image = runs.means("image_max_px", configuration=names)
    return Finding(
        found=", ".join(f"{value:.0f}" for value in image) + " px",
        held=[list(image) == sorted(image)],
        why="; ".join(f"{name[-2:]}: {outcomes(runs, name)}" for name in names) + ". "
        "A run that loses the object ends before its path can curve further. Each point is wrong "
        "in a direction of its own, drawn for each run.",
    )


CONFIGURATIONS = (
    Configuration(
        "camera_E1",
        "E1: no perturbation",
        group=CAMERA,
        published={"outcome": "converged", "time_s": "17"},
    ),
    _camera_at("E2", (0.0, 0.0, 0.0)),
    _camera_at("E3", (0.0631, 0.0, -0.01)),
    _camera_at("E4", (0.0, -0.08, -0.02)),
    _points("anchor", "E2", 0.038),
    _points("anchor", "E3", 0.073),
    _points("anchor", "E4", 0.108, "14"),
    _points("exit", "E2", 0.032),
    _points("exit", "E3", 0.103),
)
_accuracy = same_accuracy([c.name for c in CONFIGURATIONS], "section A.6")


STUDY = configuration_study(
    Plan(
        name="case-a6",
        title="IBVS on ACROBOT with a wrong model",
        why="Where the pattern lies is not printed, nor what else was wrong with the prototype.",
        cause=SOURCE,
        scenario="acrobot_pbvs",
        changes=(*SETUP, PULLEYS),
        configurations=CONFIGURATIONS,
        rendered=("camera_E1",),
        layouts={
            **four_layouts(
                "a", 14, [f"camera_{name}" for name in ("E1", "E2", "E3", "E4")], "camera wrong"
            ),
            **four_layouts(
                "a",
                18,
                ["camera_E1", *(f"anchor_{name}" for name in ("E2", "E3", "E4"))],
                "anchor points wrong",
            ),
            **four_layouts("a", 22, ["camera_E1", "exit_E2", "exit_E3"], "exit points wrong"),
        },
    ),
    source="servoing thesis A.6, figures A.14 to A.25",
    assumptions=ASSUMPTIONS,
    checks=(_any_camera, _anchors_more_than_camera, _anchors_more_than_exits, _grows, _accuracy),
)
