"""Case study VIII: planning and tracking the path of the features, on CAROCA."""

from __future__ import annotations

from cdpr_drake.analyses.case_studies import PULLEYS, CaseRuns, CaseStudy, Configuration
from cdpr_drake.analyses.reporting import Statement, verdict
from cdpr_drake.analyses.studies.cases.case_4 import ASSUMPTIONS, CAROCA_SERVO, DAMPING
from cdpr_drake.analyses.studies.cases.case_5 import HYBRID

PLANNED = (
    "The planned path is straight by construction; what can fail is how well the robot follows it."
)


def _image(runs: CaseRuns) -> Statement:
    servo, tracking = (runs.mean(name, "image_max_px") for name in ("servo", "tracking"))
    return Statement(
        "With tracking, the path in the image is straight to 5 px, more than 5 times better.",
        "figure 4.7b",
        f"{tracking:.1f} px, without {servo:.1f} px",
        verdict(tracking < 5.0 and servo > 5.0 * tracking, tracking < 5.0),
        "The largest values come where slack moves from cable to cable and the platform swings by "
        "millimetres, close to the object; the prototype's damping is not known. Means: "
        f"{runs.mean('tracking', 'image_mean_px'):.1f} px, without "
        f"{runs.mean('servo', 'image_mean_px'):.1f} px. " + PLANNED,
    )


def _camera(runs: CaseRuns) -> Statement:
    servo, tracking = (1e3 * runs.mean(name, "camera_max_m") for name in ("servo", "tracking"))
    return Statement(
        "With tracking, the camera stays within 1.5 cm of its line of 2.3 m, 4 times better.",
        "figure 4.7d",
        f"{tracking:.1f} mm, without {servo:.1f} mm",
        verdict(tracking < 15.0 and servo > 4.0 * tracking, tracking < 15.0),
        PLANNED,
    )


CASE_8 = CaseStudy(
    name="case-8",
    title="Trajectory planning and tracking on CAROCA",
    source="servoing thesis 4.4, figure 4.7",
    scenario="caroca_pbvs",
    changes=(*CAROCA_SERVO, *HYBRID, PULLEYS, DAMPING),
    configurations=(
        Configuration("servo", "2 1/2 D", published={"image_max_px": "25", "camera_max_m": "70"}),
        Configuration(
            "tracking",
            "tracking",
            (
                "trajectory={duration: 28}",
                "controller.lambda_0=1.7",
                "controller.lambda_infinity=1.7",
                "controller.rate=20",
                "camera.rate=20",
            ),
            published={"image_max_px": "5", "camera_max_m": "15"},
        ),
    ),
    rendered=("tracking",),
    quick=("tracking",),
    assumptions=ASSUMPTIONS,
    judges=(_image, _camera),
)
