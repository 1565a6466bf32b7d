"""Case study V: 2 1/2 D visual servoing on CAROCA, its first pose badly known."""

from __future__ import annotations

from cdpr_drake.analyses.studies.case_studies.case_4 import (
    ASSUMPTIONS,
    CAROCA_SERVO,
    UNKNOWN,
    believed,
)
from cdpr_drake.analyses.studies.case_studies.path_figures import HYBRID_LAYOUTS
from cdpr_drake.analyses.studies.framework.caroca_cables import CAROCA_RUN
from cdpr_drake.analyses.studies.framework.case_definition import Configuration, Plan
from cdpr_drake.analyses.studies.framework.case_run import converged, outcomes
from cdpr_drake.analyses.studies.framework.case_statements import same_accuracy
from cdpr_drake.analyses.studies.framework.case_study import configuration_study
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import HARDWARE, SOURCE, Finding, statement

HYBRID = ("controller.scheme=2.5d",)


STRAIGHTER = 0.9
"""A path is straighter that is off its line by at most this share of the other's distance: means of
runs differ by some per cent with the seeds."""


@statement(
    "Without perturbation, the path in the image is straighter than with PBVS.",
    "figures 3.36a and 3.39a",
    rule=f"its largest distance from the line at most {STRAIGHTER:g} of that with PBVS; in part: "
    "less than that",
    cause=HARDWARE,
    why="What bends both paths of the prototype is what its controller does not know: pulleys, sag "
    "and a first pose measured by hand; what of it there was is not printed.",
)
def _straighter(runs: Runs) -> Finding:
    hybrid, pose = (runs.mean("image_max_px", configuration=name) for name in ("none", "pbvs"))
    return Finding(
        found=f"largest distance {hybrid:.1f} px, PBVS {pose:.1f} px",
        held=[hybrid <= STRAIGHTER * pose],
        some=hybrid < pose,
    )


@statement(
    "Without perturbation, the camera's path is nearly straight.",
    "at most 70 mm over 2.3 m",
    cause=SOURCE,
)
def _camera(runs: Runs) -> Finding:
    found = 1e3 * runs.largest("camera_max_m", configuration="none")
    pose = 1e3 * runs.mean("camera_max_m", configuration="pbvs")
    return Finding(found=f"at most {found:.0f} mm; PBVS {pose:.0f} mm", held=[found <= 70.0])


@statement(
    "Twice the perturbation doubles the camera's deviation, and the object leaves the image.",
    "figure 3.39d",
    cause=SOURCE,
)
def _doubled(runs: Runs) -> Finding:
    camera = [1e3 * runs.mean("camera_max_m", configuration=name) for name in ("within", "beyond")]
    lost = not converged(runs, "beyond")
    return Finding(
        found=f"{camera[0]:.0f} and {camera[1]:.0f} mm; {outcomes(runs, 'beyond')}",
        held=[lost, 1.5 < camera[1] / camera[0] < 2.5],
        some=lost or camera[1] > 1.5 * camera[0],
    )


_accuracy = same_accuracy(("none", "within", "beyond"), "section 3.4.4")


STUDY = configuration_study(
    Plan(
        name="case-5",
        why=UNKNOWN,
        cause=SOURCE,
        title="2 1/2 D visual servoing on CAROCA",
        scenario="caroca_pbvs",
        changes=(*CAROCA_SERVO, *CAROCA_RUN),
        configurations=(
            Configuration(
                "none",
                "no perturbation",
                HYBRID,
                published={"outcome": "converged", "camera_max_m": "at most 70"},
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
        layouts=HYBRID_LAYOUTS,
    ),
    source="servoing thesis 3.4.4, figure 3.39",
    assumptions=ASSUMPTIONS,
    checks=(_straighter, _camera, _doubled, _accuracy),
)
