"""Questions of stability analysis III, where the robot's model is wrong, too."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import KW_ONLY, dataclass
from functools import partial

import numpy as np

from cdpr_drake.analyses.studies.framework.study import Case
from cdpr_drake.analyses.studies.stability_ranges.question import (
    PLANAR_ROBOT,
    SPATIAL_ROBOT,
    Answer,
    question,
    unit_of_limit,
)
from cdpr_drake.analyses.studies.stability_ranges.robot_limits import (
    LimitedRobot,
    RangeSearch,
    RobotLimits,
    camera_at,
)
from cdpr_drake.analyses.studies.stability_recipe import DRAWS, recipe_case, recipe_grid
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability
from cdpr_drake.workspaces.volume import VolumeRule, workspace_volume

PLANAR, SPATIAL = "planar", "acrobot_small"
"""Robots; the thesis does not say which of ACROBOT's platforms, this one is of its first
experiments."""

PLANAR_OTHERS = RobotLimits(
    place=0.2, psi=10.0, error=0.5, r_bp=0.01, d_theta_bp=3.0, r_s=0.05, r_pc=0.01,
    d_theta_pc=3.0, r_B=0.004,
)  # fmt: skip
"""Limits that a planar combination has unless it says otherwise."""

PLANAR_COARSE = RobotLimits(
    place=0.2, psi=10.0, error=1.0, r_bp=0.05, d_theta_bp=5.0, r_s=0.2, r_pc=0.01,
    d_theta_pc=10.0, r_B=0.008,
)  # fmt: skip
"""The same with coarse knowledge of everything."""

SPATIAL_OTHERS = RobotLimits(
    place=0.1, error=0.5, r_bp=0.03, d_theta_bp=3.0, r_s=0.05, r_pc=0.01, d_theta_pc=3.0,
    r_B=0.008, low=0.3, high=0.3,
)  # fmt: skip
"""Limits that a spatial combination has unless it says otherwise; r_B as published in 3.2.2."""

SPATIAL_COARSE = RobotLimits(
    place=0.1, error=1.0, r_bp=0.06, d_theta_bp=5.0, r_s=0.3, r_pc=0.01, d_theta_pc=10.0,
    r_B=0.008, low=0.3, high=0.3,
)  # fmt: skip
"""The same with coarse knowledge."""

CAMERAS = {
    "in the middle": (0.0, 0.0, 0.0),
    "on an edge": (0.055, 0.0, 0.0),
    "on a corner": (0.055, 0.055, 0.0),
    "turned 45 deg": (0.0, 0.0, 45.0),
    "turned 90 deg": (0.0, 0.0, 90.0),
    "turned 180 deg": (0.0, 0.0, 180.0),
}
"""Where the planar robot's camera sits: x, y [m] and angle [deg]; the platform's half size is
0.055 m."""

CAMERA_STEP = 0.0002
"""Resolution of the limits that are compared between these [m], a 500th of them; 0.005 m, a 20th,
left it to one step whether they are the same."""

AREAS = {"narrow": 0.03, "wide": 0.1}
"""Errors of the platform's position of two bounds whose workspaces are compared [m], as figure 3.10
does with combinations 2 and 16 of figure 3.2. Their limits are not published in numbers, so that
nothing is judged."""


@dataclass(frozen=True)
class Series:
    """Combinations that differ in one limit, and what is sought in each.

    Attributes:
        group: Name.
        others: Limits that are the same.
        varied: Limits that vary, all with the same value.
        values: Values [m, deg].
        sought: Limits of which the largest is sought, all with the same value.
        high: Largest value looked at [m, deg].
        step: Resolution [m, deg].
        proven: Whether to look for a certified one, too.
    """

    group: str
    others: RobotLimits
    varied: tuple[str, ...]
    values: tuple[float, ...]
    sought: tuple[str, ...]
    high: float
    _: KW_ONLY
    step: float
    proven: bool = False


PLACES = (0.0, 0.1, 0.2, 0.3, 0.4)
PLANAR_SERIES = (
    Series(
        "place", PLANAR_OTHERS, ("place",), (*PLACES, 0.45), ("r_bp",), 0.4,
        step=0.005, proven=True,
    ),
    Series(
        "error", PLANAR_OTHERS, ("error",), (0.05, 0.1, 0.5, 1.0, 2.0), ("r_s",), 2.0,
        step=0.02,
    ),
    Series("r_pc", PLANAR_OTHERS, ("r_pc",), (0.0, 0.01, 0.03, 0.05), ("psi",), 90.0, step=1.0),
    Series(
        "r_pc coarse", PLANAR_COARSE, ("r_pc",), (0.0, 0.01, 0.03, 0.05), ("psi",), 90.0,
        step=1.0,
    ),
    Series(
        "r_B", PLANAR_OTHERS, ("r_B",), (0.0, 0.004, 0.008, 0.016, 0.03), ("d_theta_bp",), 90.0,
        step=1.0, proven=True,
    ),
    Series("psi", PLANAR_OTHERS, ("place",), (*PLACES, 0.45), ("psi",), 90.0, step=1.0),
)  # fmt: skip
SPATIAL_SERIES = (
    *(
        Series(
            f"{name} {what}{words}", others, (name,), (0.0, 0.05, 0.1, 0.2), sought, high,
            step=step,
        )
        for words, others in (("", SPATIAL_COARSE), (" well", SPATIAL_OTHERS))
        for name in ("r_bp", "r_pc")
        for what, sought, high, step in (
            ("psi", ("psi",), 150.0, 2.0), ("tilt", ("phi", "theta"), 60.0, 1.0),
        )
    ),
    Series(
        "psi tilt", SPATIAL_OTHERS, ("psi",), (0.0, 15.0, 30.0, 45.0, 60.0), ("phi", "theta"),
        60.0, step=1.0,
    ),
    Series(
        "place r_bp", SPATIAL_OTHERS, ("place",), PLACES, ("r_bp",), 1.0,
        step=0.01, proven=True,
    ),
    Series(
        "height r_bp", SPATIAL_OTHERS.varied(("place",), 0.0), ("low", "high"),
        (0.0, 0.3, 0.6, 0.8, 1.0), ("r_bp",), 1.0, step=0.01,
    ),
    Series("place psi", SPATIAL_COARSE, ("place",), PLACES, ("psi",), 150.0, step=2.0),
    Series("place tilt", SPATIAL_OTHERS, ("place",), PLACES, ("phi", "theta"), 60.0, step=1.0),
    Series(
        "height tilt", SPATIAL_OTHERS.varied(("place",), 0.0), ("low", "high"),
        (0.0, 0.3, 0.6, 0.8, 1.0), ("phi", "theta"), 60.0, step=1.0,
    ),
)  # fmt: skip
"""Combinations of analysis III. Places and angles are limits, each with everything within."""


def robot_cases(quick: bool) -> Iterator[Case]:
    """All of them; `quick`: few, coarsely."""
    middle = LimitedRobot(PLANAR, steps=1 if quick else 2, mirrored=True, coarse=quick)
    for series in PLANAR_SERIES:
        yield from _series_cases("planar-III", PLANAR_ROBOT, middle, series, quick)
    for words, (x, y, angle) in CAMERAS.items():
        robot = LimitedRobot(PLANAR, camera_at(x, y, angle), coarse=quick)
        limits = PLANAR_OTHERS.varied(("place",), 0.3)
        yield question(
            f"planar-III-camera-{words}".replace(" ", "-"), PLANAR_ROBOT, "camera",
            {"camera_x": x, "camera_y": y, "camera_turn": angle, **limits.given("r_bp")},
            "r_bp", partial(robot_limit, robot, limits, ("r_bp",), 0.4, CAMERA_STEP, False),
        )  # fmt: skip
    for words, r_bp in AREAS.items():
        limits = PLANAR_OTHERS.varied(("r_bp",), r_bp)
        yield question(
            f"planar-III-area-{words}", PLANAR_ROBOT, "area", limits.given("place", "psi"),
            "workspace", partial(workspace_area, limits, quick),
        )  # fmt: skip
    for series in SPATIAL_SERIES:
        yield from _series_cases(
            "spatial-III", SPATIAL_ROBOT, LimitedRobot(SPATIAL, coarse=quick), series, quick
        )


def _series_cases(
    prefix: str, section: str, robot: LimitedRobot, series: Series, quick: bool
) -> Iterator[Case]:
    values = series.values[:: len(series.values) - 1] if quick else series.values
    for value in values:
        limits = series.others.varied(series.varied, value)
        yield question(
            f"{prefix}-{series.group}-{value:g}".replace(" ", "-"), section, series.group,
            limits.given(*series.sought), ", ".join(series.sought),
            partial(
                robot_limit, robot, limits, series.sought, series.high,
                (5.0 if quick else 1.0) * series.step, series.proven and not quick,
            ),
        )  # fmt: skip


def robot_limit(
    robot: LimitedRobot,
    limits: RobotLimits,
    sought: tuple[str, ...],
    high: float,
    step: float,
    proven: bool,
) -> Answer:
    """The largest of the sought limits by search, and in eighths of it what is certified."""
    found = RangeSearch(robot).largest(limits, sought, high, step)
    unit = unit_of_limit(sought[0])
    answers = {f"searched_{unit}": found}
    if proven and found > 0.0:
        proof = RangeSearch(robot, "certified")
        answers[f"certified_{unit}"] = proof.largest(limits, sought, found, found / 8.0)
    return answers


def workspace_area(limits: RobotLimits, quick: bool) -> Answer:
    """Share of the planar grid that is stable within the bounds, by verdict."""
    case, grid = recipe_case(PLANAR, "pbvs"), recipe_grid(PLANAR, quick)
    options = VerdictOptions(draws=DRAWS, margins=False)
    shares = {}
    for verdict in ("sampled", "searched"):
        stable = judge_stability(case, limits.bounds(), grid.pose_rows(), verdict, options).stable
        inside = np.reshape(stable, grid.shape)[0]
        share = workspace_volume(inside, grid.axes, VolumeRule.CORNERS).share
        shares[f"{verdict}_percent"] = 100.0 * share
    return shares
