"""Case study V: 2 1/2 D visual servoing on CAROCA, its first pose badly known."""

from __future__ import annotations

from cdpr_drake.analyses.reporting.statements import Statement, verdict
from cdpr_drake.analyses.studies.case_studies.case_4 import (
    ASSUMPTIONS,
    CAROCA_SERVO,
    DAMPING,
    believed,
)
from cdpr_drake.analyses.studies.case_studies.path_figures import HYBRID_LAYOUTS
from cdpr_drake.analyses.studies.framework.case_definition import PULLEYS, CaseStudy, Configuration
from cdpr_drake.analyses.studies.framework.case_run import CaseRuns
from cdpr_drake.analyses.studies.framework.case_statements import same_accuracy

HYBRID = ("controller.scheme=2.5d",)


def _straighter(runs: CaseRuns) -> Statement:
    hybrid, pose = (runs.mean(name, "image_max_px") for name in ("none", "pbvs"))
    return Statement(
        "Without perturbation, the path in the image is straighter than with PBVS.",
        "figures 3.36a and 3.39a",
        f"largest distance {hybrid:.1f} px, PBVS {pose:.1f} px",
        verdict(hybrid < pose),
    )


def _camera(runs: CaseRuns) -> Statement:
    found = 1e3 * runs.largest("none", "camera_max_m")
    pose = 1e3 * runs.mean("pbvs", "camera_max_m")
    return Statement(
        "Without perturbation, the camera's path is nearly straight.",
        "at most 70 mm over 2.3 m",
        f"at most {found:.0f} mm; PBVS {pose:.0f} mm",
        verdict(found <= 70.0),
    )


def _doubled(runs: CaseRuns) -> Statement:
    camera = [1e3 * runs.mean(name, "camera_max_m") for name in ("within", "beyond")]
    lost = not runs.converged("beyond")
    return Statement(
        "Twice the perturbation doubles the camera's deviation, and the object leaves the image.",
        "figure 3.39d",
        f"{camera[0]:.0f} and {camera[1]:.0f} mm; {runs.outcomes('beyond')}",
        verdict(lost and 1.5 < camera[1] / camera[0] < 2.5, lost or camera[1] > 1.5 * camera[0]),
    )


def _accuracy(runs: CaseRuns) -> Statement:
    return same_accuracy(runs, ("none", "within", "beyond"), "section 3.4.4")


CASE_5 = CaseStudy(
    name="case-5",
    title="2 1/2 D visual servoing on CAROCA",
    source="servoing thesis 3.4.4, figure 3.39",
    scenario="caroca_pbvs",
    changes=(*CAROCA_SERVO, PULLEYS, DAMPING),
    configurations=(
        Configuration(
            "none",
            "no perturbation",
            HYBRID,
            published={"outcome": "converged", "camera_max_m": "70"},
        ),
        Configuration(
            "within",
            "0.2 m, 4 deg",
            (*HYBRID, believed(0.2, 4.0)),
            published={"outcome": "converged"},
        ),
        Configuration(
            "beyond",
            "0.4 m, 8 deg",
            (*HYBRID, believed(0.4, 8.0)),
            published={"outcome": "target_lost"},
        ),
        Configuration("pbvs", "PBVS, no perturbation"),
    ),
    rendered=("none",),
    assumptions=ASSUMPTIONS,
    judges=(_straighter, _camera, _doubled, _accuracy),
    layouts=HYBRID_LAYOUTS,
)
