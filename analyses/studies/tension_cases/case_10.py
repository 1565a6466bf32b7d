"""Case study X: cables that are slack at the start, on CAROCA, with and without correction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdpr_drake.analyses.studies.framework.caroca_cables import CAROCA_ASSUMPTION
from cdpr_drake.analyses.studies.framework.case_definition import PULLEYS, Configuration, Plan
from cdpr_drake.analyses.studies.framework.case_study import configuration_study
from cdpr_drake.analyses.studies.framework.statement import SOURCE
from cdpr_drake.analyses.studies.tension_cases.case_10_estimates import ESTIMATES
from cdpr_drake.analyses.studies.tension_cases.case_10_statements import (
    METRICS,
    PUBLISHED_PATHS,
    STATEMENTS,
    THRESHOLD,
    THRESHOLDS,
    chosen,
)
from cdpr_drake.analyses.studies.tension_cases.slack_experiments import (
    CORRECTED,
    OFF,
    PLAIN,
    experiments,
    slack_change,
)
from cdpr_drake.analyses.studies.tension_cases.slack_figures import CASE_10_LAYOUTS
from cdpr_drake.analyses.studies.tension_cases.slack_metrics import slack_metrics

SLACK_CABLES = (2, 7)
"""Cables that are paid out at the start: those whose tensions begin just below the threshold."""

ON = f"tension_management={{kind: constant, threshold: {list(THRESHOLDS)}, gain: 0.001}}"

OTHER_CABLES = {"cables_1_2": (1, 2), "cables_7": (7,), "cables_7_8": (7, 8)}
"""Cables that could have been paid out as well, by the names of configurations."""

SOFTNESS = ("0.02", "0.1")
"""Stiffness of the cables as mounted, of that by the modulus of steel, beside all of it."""

MASSLESS = (
    "cables={model: kelvin_voigt, stiffness_ratio: 0.05, retardation_time: 0.006}",
    "damping={translation: 0, rotation: 0}",
)
"""Cables that were once fitted to E3 to E10: straight, without weight or pulleys, a twentieth of
steel's stiffness, a tenth of critical damping."""

RETARDATION = 3.0e-4
"""Retardation time in the robot's file [s]."""

ACCURACIES = ("25", "75")
"""Constant errors of the sensors that the readings of slack cables do not hold [N]."""


def _published() -> dict[str, dict[str, str]]:
    found = {
        name: {"image_max_px": f"{image:g}", "camera_max_m": f"{camera:g}"}
        for name, (image, camera) in PUBLISHED_PATHS.items()
    }
    for name in PLAIN[1:]:
        found.setdefault(name, {})["c7_taut_s"] = "about 10"
    for name in CORRECTED[1:]:
        found.setdefault(name, {})["c7_taut_s"] = "below 2"
    found["E7"]["estimate_end_m"] = "60"
    found["E9"] |= {"outcome": "fails", "estimate_end_m": "50", "estimate_end_rad": "over 20"}
    return found


def _pair(name: str, words: str, changes: Sequence[str], group: str) -> list[Configuration]:
    """Without and with correction, 6 cm of slack unless changed."""
    return [
        Configuration(f"{name}_{end}", words + more, (*changes, change), group)
        for end, more, change in (("plain", "", OFF), ("corrected", ", corrected", ON))
    ]


def _other_cables() -> list[Configuration]:
    found: list[Configuration] = []
    for name, cables in OTHER_CABLES.items():
        words = "slack on cables " + ", ".join(str(number) for number in cables)
        found += _pair(name, words, (slack_change(6, cables),), "cables")
    return found


def _softer() -> list[Configuration]:
    found: list[Configuration] = []
    for ratio in SOFTNESS:
        damping = RETARDATION / np.sqrt(float(ratio))  # the same share of critical damping
        cables = (f"cables.stiffness_ratio={ratio}", f"cables.retardation_time={damping:.6f}")
        change = (slack_change(6, SLACK_CABLES), *cables)
        found += _pair(f"stiffness_{ratio}", f"stiffness x {ratio}", change, "stiffness")
    massless = (slack_change(6, SLACK_CABLES), *MASSLESS)
    return [*found, *_pair("massless", "massless, stiffness x 0.05", massless, "stiffness")]


def _worse_sensors() -> list[Configuration]:
    return [
        Configuration(
            f"accuracy_{accuracy}_corrected",
            f"sensors off by up to {accuracy} N, corrected",
            (slack_change(6, SLACK_CABLES), ON, f"sensors.tension_accuracy={accuracy}"),
            "sensors",
        )
        for accuracy in ACCURACIES
    ]


STUDY = configuration_study(
    Plan(
        name="case-10",
        why="which cables were slack and what the controller believed wrongly is not printed",
        cause=SOURCE,
        title="Slack cables on CAROCA, with and without tension correction",
        scenario="caroca_slack_start",
        changes=(
            PULLEYS,
            "perturbations.initial_pose_shift={distance: 0.02, angle_deg: 1.5}",
            "perturbations.exit_points=0.005",
            "perturbations.anchor_points=0.002",
            "sensors.log=[tension]",
            "integration.engine=compiled",
        ),
        configurations=(
            *experiments(SLACK_CABLES, ON, _published()),
            *_other_cables(),
            *_softer(),
            *_worse_sensors(),
        ),
        rendered=("E8",),
        own={**slack_metrics(THRESHOLD), **METRICS},
        layouts=CASE_10_LAYOUTS,
        stability=THRESHOLD,
    ),
    source="servoing thesis 5.3.2, figures 5.24 to 5.26",
    repetitions=10,
    assumptions=(
        "Which cables are paid out is not printed: C2 and C7, whose tensions begin just below the "
        "threshold; C1 and C2, C7 alone, C7 and C8 are run beside them.",
        "The platform hangs at rest with the slack when the servo starts: it is printed that it "
        "turns a little when slack is added, and that the first image shows that.",
        CAROCA_ASSUMPTION,
        "Stiffness of the cables as mounted is not printed: two smaller ones are run beside it, "
        "and massless cables that were fitted once, with three runs each of E3, E4, E7, E8, E9 and "
        "E10 in sight.",
        "The readings of slack cables hold the constant errors of the sensors, as they were taken "
        "on this robot; what they do not hold, at other poses, is 0 here, and 25 and 75 N beside.",
        "The printed poses of the tag in the camera at start and goal put it 0.12 m and 0.10 m "
        "below the ground, 25 mm apart and turned by 208 deg. Here it lies on the ground, where "
        "the first one puts it, and the goal is the printed desired pose of the platform.",
        "What controller and estimator believe wrongly is not printed: the first pose by 20 mm and "
        "1.5 deg, exit points by 5 mm, anchor points by 2 mm, in directions drawn for each seed.",
        "The robot is moved by the compiled engine, see `cdpr study engines`.",
    ),
    checks=(
        *STATEMENTS,
        *ESTIMATES,
        chosen(
            "chosen_cables",
            ("E7/E8", *OTHER_CABLES),
            "Which cables are slack is chosen: C2 and C7, or others.",
            "that tau_2 and tau_7 begin just below the threshold",
        ),
        chosen(
            "chosen_stiffness",
            ("E7/E8", *(f"stiffness_{ratio}" for ratio in SOFTNESS), "massless"),
            "How the cables are modelled is chosen.",
            "nothing",
        ),
        chosen(
            "chosen_accuracy",
            ("E7/E8", *(f"E7/accuracy_{accuracy}_corrected" for accuracy in ACCURACIES)),
            "How wrong the sensors are beyond what they read on slack cables is chosen.",
            "that they are substantially different at other poses; accuracy 75 N",
        ),
    ),
)
