"""The study: its runs, tables, figure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from pydrake.common.yaml import yaml_dump_typed

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import Cell, Summary
from cdpr_drake.analyses.studies.fusion.configurations import SERVO, SLACK, cases
from cdpr_drake.analyses.studies.fusion.figures import fusion_figure
from cdpr_drake.analyses.studies.fusion.slack_trials import measure_slack
from cdpr_drake.analyses.studies.fusion.statements import CHECKS
from cdpr_drake.analyses.studies.fusion.trials import SCENARIO, measure_fusion
from cdpr_drake.systems.diagrams.load import load_scenario

ASSUMPTIONS = (
    "Nothing of this is printed but that it could be done. Where the tag on the platform is, its "
    "size, the noise of 0.3 px and that the camera in the world is one image late are chosen.",
    "What is believed wrongly is drawn normally for each seed, by what the filter is told: the "
    "start by 5 mm and 0.5 deg on each axis, the camera on board by 3 mm and 0.3 deg, that in the "
    "world by 3 mm and 0.2 deg, the target's place by 10 mm and 1 deg. A camera that is wrong by 2 "
    "cm and 1 deg is so in a drawn direction on top of that; the filter is not told, unless a "
    "configuration says so: then that camera is worse with probability 0.5, by 12 mm and 0.6 deg "
    "on each axis; where both are doubted, each with 0.05, by 20 mm and 1 deg.",
    "Encoders and tension sensors are ideal and read by every configuration.",
    "Slack is that of case study IX, E3, E5 and E9, on cables 1 and 2, with a projected camera; "
    "believed wrongly are exit and anchor points by 5 mm, the start by 2 mm and 0.2 "
    "deg. A cable in the image is 15 points with a noise of 0.5 px; nothing hides it.",
    "The IMU is the ADIS16448, the depth camera in the world a Kinect.",
)


def measure(case: Case, seed: int) -> dict[str, Any]:
    """A run of a servo, or of a start with slack cables."""
    return (measure_slack if case.keys["trial"] == SLACK else measure_fusion)(case, seed)


def parameters(form: Form) -> Mapping[str, Any]:
    """The scenario that configurations change."""
    return {"scenario": yaml_dump_typed(load_scenario(SCENARIO))}


def _mean_and_worst(column: str, unit: str, digits: int) -> Callable[[Runs], str]:
    """Words of a column: the mean, and in brackets the largest."""

    def words(runs: Runs) -> str:
        cells = (Cell(reduction, column, f".{digits}f") for reduction in ("mean", "largest"))
        mean, largest = (cell.words(runs, unit) for cell in cells)
        return f"{mean} ({largest})"

    return words


STUDY = Study(
    name="fusion",
    title="Two cameras, lengths, an IMU and depths fused, each failing or wrong in its turn",
    source="servoing thesis, perspectives",
    cases=cases,
    measure=measure,
    seeds=(10, 1),
    parameters=parameters,
    assumptions=ASSUMPTIONS,
    checks=CHECKS,
    stated="What is stated",
    tables=[
        Summary(
            "Fusion of sensors, means over seeds and in brackets the worst",
            ("sources",),
            {
                "at the target [mm]": _mean_and_worst("servo_m", "mm", 2),
                "estimate at the end [mm]": _mean_and_worst("final_m", "mm", 1),
                "mean [mm]": _mean_and_worst("mean_m", "mm", 1),
                "mean [deg]": _mean_and_worst("mean_rad", "deg", 2),
                "largest [mm]": _mean_and_worst("largest_m", "mm", 1),
                "NEES": _mean_and_worst("nees", "", 1),
                "world left out": Cell("mean", "external_left_out", ".0%"),
            },
            where={"trial": SERVO},
        ),
        Summary(
            "Two cables slack at the start, means over seeds",
            ("way", "surplus_m"),
            {
                "taut after [s]": Cell("mean", "taut_s", ".2f"),
                "fastest [m/s]": Cell("mean", "fastest_m_s", ".2f"),
                "estimate [mm]": Cell("mean", "estimate_m", ".1f"),
                "seen slack wrong by [mm]": Cell("mean", "seen_error_m", ".1f"),
                "its bias [mm]": Cell("mean", "seen_bias_m", "+.1f"),
                "seen": Cell("mean", "seen_share", ".0%"),
            },
            where={"trial": SLACK},
        ),
    ],
    figures={"fusion": fusion_figure},
)
