"""The study: its runs, table, figures."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from pydrake.common.yaml import yaml_dump_typed

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.study import Form, Study
from cdpr_drake.analyses.studies.framework.summary import Summary
from cdpr_drake.analyses.studies.mobile_robot import (
    slack_statements,
    statements,
    view_statements,
)
from cdpr_drake.analyses.studies.mobile_robot.configurations import PUBLISHED, cases
from cdpr_drake.analyses.studies.mobile_robot.figures import (
    choices_figure,
    laps_figure,
    views_figure,
)
from cdpr_drake.analyses.studies.mobile_robot.lap_figures import (
    PATHS,
    lengths_figure,
    paths_figure,
)
from cdpr_drake.analyses.studies.mobile_robot.laps import SCENARIO, measure
from cdpr_drake.analyses.studies.mobile_robot.tension_figures import TENSIONS, tensions_figure
from cdpr_drake.systems.diagrams.load import load_scenario

ASSUMPTIONS = (
    "The track is not printed: a rectangle of 0.26 x 0.16 m with rounded corners, as fast as the "
    "printed gains follow with the tag in view; a smaller and a larger one are run beside it.",
    "The tag turns with the mobile robot, all round once a lap, which the platform cannot: the "
    "rotation about the optical axis is left free, and the platform keeps its yaw in the estimate.",
    "Friction of the winches is not printed: that of the robot's file; none and three times as "
    "much are run beside it.",
    "By what winches run off their commands is not printed: 1 mm/s each, fitted to the printed "
    "drift of 0.3 m in 12 laps, and up to 0.2 mm/s more or less, fitted to 0.15 m of cable in 20; "
    "half and twice as much of each is run beside it. Without it nothing grows: lengths that "
    "follow the integral of the commands come back to what they were after each lap.",
    "Stiffness and damping of the cables as mounted are those fitted for case study IX.",
    "Believed wrongly: exit and anchor points by 5 mm, manufacturing errors as 3.3.3 and 4.3.1 "
    "have them and as in case studies I and IX; the camera by 5 mm and 1 deg, the first pose by 2 "
    "mm and 0.2 deg, chosen; in directions drawn for each seed.",
    "Size and distance of the tag are not printed: 60 mm at 0.30 m; estimators 1, 4 and 7 follow "
    "it at four others, too.",
    "The estimator of 5.3.1 is that of 2.3.7 that lasts 210 s, control integration.",
    "A cable counts as slack below 0.24 N, the accuracy of the sensors.",
)


def parameters(form: Form) -> Mapping[str, Any]:
    """The scenario that configurations change."""
    return {"scenario": yaml_dump_typed(load_scenario(SCENARIO))}


def extreme(runs: Runs, column: str) -> float:
    """The worst of a column over all laps and runs; NaN where there is none."""
    values = runs[column]
    there = values[np.isfinite(values)]
    if len(there) == 0:
        return float("nan")
    return float(np.min(there) if column == "seen" else np.max(there))


def extremes(runs: Runs) -> dict[str, Any]:
    """The worst of all laps, by configuration and column."""
    columns = [name for name in runs.arrays() if runs.rows[0][name].ndim == 1]
    return {
        name: {column: extreme(some, column) for column in columns}
        for name, some in runs.by("configuration")
    }


STUDY = Study(
    name="mobile-robot",
    title="A tag on a mobile robot that goes round, followed until that fails, or for three hours",
    source="servoing thesis 2.3.7, 5.3.1",
    cases=cases,
    measure=measure,
    seeds=(10, 1),
    parameters=parameters,
    assumptions=ASSUMPTIONS,
    numbers=extremes,
    checks=(*statements.CHECKS, *slack_statements.CHECKS, *view_statements.CHECKS),
    stated="What the thesis states",
    tables=[
        Summary(
            "A tag on a mobile robot",
            ("words",),
            {
                "published": lambda runs: PUBLISHED.get(runs.rows[0].case, ""),
                "laps until failure": statements.laps_words,
                "most slack": lambda runs: f"{extreme(runs, 'most_slack'):.0f}",
                "estimate [mm]": lambda runs: f"{1e3 * extreme(runs, 'estimate_m'):.0f}",
                "estimate [deg]": lambda runs: f"{np.degrees(extreme(runs, 'estimate_rad')):.1f}",
                "tension [N]": lambda runs: f"{extreme(runs, 'tension_n'):.1f}",
            },
        )
    ],
    figures={
        "mobile_robot": laps_figure,
        "choices": choices_figure,
        "views": views_figure,
        **{name: partial(tensions_figure, name) for name in TENSIONS},
        **{name: partial(paths_figure, name) for name in PATHS},
        "lengths_by_lap": lengths_figure,
    },
)
