"""Case study VI: image-based visual servoing on ACROBOT, its first pose badly known."""

from __future__ import annotations

from cdpr_drake.analyses.case_studies import (
    PULLEYS,
    CaseRuns,
    CaseStudy,
    Configuration,
    same_accuracy,
)
from cdpr_drake.analyses.reporting import Statement, verdict
from cdpr_drake.analyses.studies.cases.image_based import ASSUMPTIONS, SETUP
from cdpr_drake.analyses.studies.cases.path_figures import four_layouts

NAMES = ("E1", "E2", "E3", "E4")


def _shifted(name: str, distance: float, angle_deg: float, outcome: str) -> Configuration:
    return Configuration(
        name,
        f"{name}: {distance:g} m, {angle_deg:g} deg",
        (f"perturbations.initial_pose_shift={{distance: {distance:g}, angle_deg: {angle_deg:g}}}",),
        published={"outcome": outcome},
    )


def _tolerates(runs: CaseRuns) -> Statement:
    good = [runs.converged(name) for name in NAMES[:3]]
    return Statement(
        "IBVS ends its task under the perturbations of E1 to E3.",
        "figures 3.41 to 3.44",
        "; ".join(f"{name}: {runs.outcomes(name)}" for name in NAMES[:3]),
        verdict(all(good), any(good)),
    )


def _not_all(runs: CaseRuns) -> Statement:
    return Statement(
        "Under that of E4 it does not end: it swings about the goal.",
        "figures 3.41d to 3.43d",
        f"E4: {runs.outcomes('E4')}",
        verdict(
            not any(run.outcome == "converged" for run in runs.of("E4")), not runs.converged("E4")
        ),
        "The direction counts as much as the size, and is not printed.",
    )


def _curved(runs: CaseRuns) -> Statement:
    image = [runs.mean(name, "image_max_px") for name in NAMES]
    return Statement(
        "The larger the perturbation, the more the paths curve.",
        "figure 3.41",
        "largest distance of the pattern's middle from its straight line "
        + ", ".join(f"{value:.0f}" for value in image)
        + " px",
        verdict(image == sorted(image), image[0] < min(image[1:])),
    )


def _accuracy(runs: CaseRuns) -> Statement:
    return same_accuracy(runs, NAMES, "section 3.4.5")


CASE_6 = CaseStudy(
    name="case-6",
    title="IBVS on ACROBOT",
    source="servoing thesis 3.4.5, figures 3.41 to 3.44",
    scenario="acrobot_pbvs",
    changes=(*SETUP, PULLEYS),
    configurations=(
        Configuration("E1", "E1: no perturbation", published={"outcome": "converged"}),
        _shifted("E2", 0.08, 10.0, "converged"),
        _shifted("E3", 0.145, 19.0, "converged, 4 s later"),
        _shifted("E4", 0.28, 37.0, "swings about the goal"),
    ),
    rendered=("E1",),
    assumptions=ASSUMPTIONS,
    judges=(_tolerates, _not_all, _curved, _accuracy),
    layouts=four_layouts("3", 41, NAMES, "first pose wrong"),
)
