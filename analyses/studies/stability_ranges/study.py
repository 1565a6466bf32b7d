"""Study: how large errors may be before a servo's stability is lost."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.stability_ranges import (
    planar_statements,
    robot_limits,
    robots,
    single_errors,
    single_statements,
    spatial_statements,
)
from cdpr_drake.analyses.studies.stability_ranges.figures import FIGURES
from cdpr_drake.analyses.studies.stability_ranges.question import measure
from cdpr_drake.analyses.studies.stability_ranges.tables import range_tables
from cdpr_drake.analyses.studies.stability_ranges.vision import vision_cases
from cdpr_drake.analyses.studies.stability_recipe import DRAWS


def cases(form: Form) -> Iterator[Case]:
    """All questions; in the quick form fewer and coarser ones."""
    yield from vision_cases(form.quick)
    yield from robots.robot_cases(form.quick)
    yield from single_errors.single_cases(form.quick)


def parameters(form: Form) -> Mapping[str, Any]:
    """What all questions have in common."""
    return {
        "single errors": {"draws": DRAWS, "seed": 0, "robot": single_errors.ROBOT},
        "combinations": {
            "options": asdict(robot_limits.OPTIONS),
            "turn_step_deg": robot_limits.TURN_STEP,
            "tilt_step_deg": robot_limits.TILT_STEP,
            "robots": [robots.PLANAR, robots.SPATIAL],
        },
    }


STUDY = Study(
    name="stability-ranges",
    title="How large errors may be before a servo's stability is lost",
    source="servoing thesis 3.2.1, 3.2.2, 3.3.2 and 3.4.2",
    cases=cases,
    measure=measure,
    parameters=parameters,
    unit="questions",
    stated="What the servoing thesis states",
    checks=(*planar_statements.CHECKS, *spatial_statements.CHECKS, *single_statements.CHECKS),
    tables=[range_tables],
    figures=FIGURES,
)
