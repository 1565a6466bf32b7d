"""Case study VI: image-based visual servoing on four points, ACROBOT's first pose badly known.

`SETUP` and `ASSUMPTIONS` are also those of case study A.6, its appendix.

Source: servoing thesis 3.4.5.
"""

from __future__ import annotations

from cdpr_drake.analyses.studies.case_studies.path_figures import four_layouts
from cdpr_drake.analyses.studies.framework.case_definition import PULLEYS, Configuration, Plan
from cdpr_drake.analyses.studies.framework.case_run import converged, outcomes
from cdpr_drake.analyses.studies.framework.case_statements import same_accuracy
from cdpr_drake.analyses.studies.framework.case_study import configuration_study
from cdpr_drake.analyses.studies.framework.experiments import (
    DIRECTIONS,
    DRAWN,
    as_transform,
    pose_item,
)
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import SOURCE, Finding, statement

START = as_transform(((0.118, -0.104, 0.459), (16.0, 13.8, 20.6)))
"""Printed initial pose of the platform in W."""

EDGE = 0.0854
"""Edge of the square of points [m]."""

DESIRED_COORDINATE = 0.167
"""Printed desired coordinates of the points are +- this, at unit focal length [-]."""

DEPTH = EDGE / 2.0 / DESIRED_COORDINATE
"""Desired distance of the points from the camera [m]."""

SETUP = (
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
)

ASSUMPTIONS = (
    "The printed poses of the platform and the printed features do not fit each other. The pattern "
    "lies on the ground where the initial features and the initial pose put its middle; that also "
    "gives its size, and with the desired features the desired distance.",
    DRAWN,
    "Stop rules and sigma are those of case study I.",
)

NAMES = ("E1", "E2", "E3", "E4")


def _shifted(name: str, distance: float, angle_deg: float, outcome: str) -> Configuration:
    return Configuration(
        name,
        f"{name}: {distance:g} m, {angle_deg:g} deg",
        (f"perturbations.initial_pose_shift={{distance: {distance:g}, angle_deg: {angle_deg:g}}}",),
        published={"outcome": outcome},
    )


@statement(
    "IBVS ends its task under the perturbations of E1 to E3.",
    "figures 3.41 to 3.44",
    cause=SOURCE,
    why=DIRECTIONS,
)
def _tolerates(runs: Runs) -> Finding:
    good = [converged(runs, name) for name in NAMES[:3]]
    return Finding(
        found="; ".join(f"{name}: {outcomes(runs, name)}" for name in NAMES[:3]), held=good
    )


@statement(
    "Under that of E4 it does not end: it swings about the goal.",
    "figures 3.41d to 3.43d",
    cause=SOURCE,
)
def _not_all(runs: Runs) -> Finding:
    return Finding(
        found=f"E4: {outcomes(runs, 'E4')}",
        held=[run["outcome"] != "converged" for run in runs(configuration="E4")],
        why="The direction counts as much as the size, and is not printed.",
    )


@statement(
    "The larger the perturbation, the more the paths curve.",
    "figure 3.41",
    cause=SOURCE,
    why=DIRECTIONS,
)
def _curved(runs: Runs) -> Finding:
    image = runs.means("image_max_px", configuration=NAMES)
    return Finding(
        found="largest distance of the pattern's middle from its straight line "
        + ", ".join(f"{value:.0f}" for value in image)
        + " px",
        held=[list(image) == sorted(image)],
        some=bool(image[0] < min(image[1:])),
    )


_accuracy = same_accuracy(NAMES, "section 3.4.5")


STUDY = configuration_study(
    Plan(
        name="case-6",
        title="IBVS on ACROBOT",
        why=DIRECTIONS,
        cause=SOURCE,
        scenario="acrobot_pbvs",
        changes=(*SETUP, PULLEYS),
        configurations=(
            Configuration("E1", "E1: no perturbation", published={"outcome": "converged"}),
            _shifted("E2", 0.08, 10.0, "converged"),
            _shifted("E3", 0.145, 19.0, "converged, 4 s later"),
            _shifted("E4", 0.28, 37.0, "swings about the goal"),
        ),
        rendered=("E1",),
        layouts=four_layouts("3", 41, NAMES, "first pose wrong"),
    ),
    source="servoing thesis 3.4.5, figures 3.41 to 3.44",
    assumptions=ASSUMPTIONS,
    checks=(_tolerates, _not_all, _curved, _accuracy),
)
