"""Questions of stability analyses I and II, where the robot's own model is exact."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

from cdpr_drake.analyses.studies.framework.study import Case
from cdpr_drake.analyses.studies.stability_ranges.question import (
    PLANAR_VISION,
    SPATIAL_CAMERA,
    SPATIAL_VISION,
    Answer,
    bisected,
    question,
    unit_of_limit,
)
from cdpr_drake.analyses.studies.stability_ranges.robot_limits import (
    LimitedRobot,
    RangeSearch,
    RobotLimits,
)
from cdpr_drake.stability.criterion_closed_forms import (
    PlanarVisionLimits,
    planar_margin,
    worst_object_error,
)

PLANAR_PUBLISHED = {(5.0, 0.5, 0.3): 6.0, (0.5, 0.3, 0.2): 61.0}
"""Combinations 2 and 13 of figure 3.1: limits of each component of e, of its error and of the
camera's position [m], and of the camera's turn [deg]. Source: 3.2.1."""

PLANAR_NUMBERS = {(5.0, 0.5, 0.3): "Cb. 2", (0.5, 0.3, 0.2): "Cb. 13"}
"""Their names."""

PLANAR_ERRORS = (0.5, 1.0, 2.0, 5.0)
PLANAR_PERTURBATIONS = ((0.1, 0.1), (0.3, 0.2), (0.5, 0.3), (0.7, 0.4), (0.9, 0.5))
"""Combinations of this study: every limit of e with every pair of limits of its error and of the
camera's position [m]; the thesis' two are among them."""

OBJECT_TURNS = (0.0, 20.0, 40.0, 60.0, 80.0, 90.0, 100.0, 120.0, 140.0, 160.0)
OBJECT_TURN_ERRORS = (0.0, 10.0, 20.0, 30.0, 45.0, 60.0, 75.0, 89.0)
"""Limits of theta, and of its error, for which the largest error of the object's position is sought
[deg]."""

PUBLISHED_OBJECT = {"place": 1.5, "turn": 160.0, "turn_error": 90.0}
"""Largest limits that figure 3.3 has [m, deg]. Source: 3.2.2."""

TURNS_SOUGHT = (10.0, 20.0, 45.0, 90.0)
"""Limits of theta's error for which the largest theta is sought [deg]."""

ROBOT = "acrobot_small"
"""Analysis II holds for any robot; this one carries the computation."""

OBJECT = RobotLimits(low=0.3, high=0.3, error=0.5, r_s=0.1, r_pc=0.02, d_theta_pc=10.0)
"""What the groups of analysis II have in common; of theta u nothing is asked there."""


def vision_cases(quick: bool) -> Iterator[Case]:
    """All of them; `quick`: every third."""
    step = 3 if quick else 1
    yield question("planar-I", PLANAR_VISION, "I", {}, "r_s", partial(planar_place), found_m=2.0)
    planar = [(e, *pair) for e in PLANAR_ERRORS for pair in PLANAR_PERTURBATIONS]
    for number, limits in enumerate(planar):
        if number % step and limits not in PLANAR_PUBLISHED:
            continue
        names = dict(zip(("error", "r_s", "r_pc"), limits, strict=True))
        printed = {"found_deg": PLANAR_PUBLISHED[limits]} if limits in PLANAR_PUBLISHED else {}
        yield question(
            "planar-II-{:g}-{:g}-{:g}".format(*limits), PLANAR_VISION, "II", names,
            "d_theta_pc", partial(planar_turn, *limits), **printed,
        )  # fmt: skip
    for turn in OBJECT_TURNS[::step]:
        for error in OBJECT_TURN_ERRORS[::step]:
            yield question(
                f"spatial-I-{turn:g}-{error:g}", SPATIAL_VISION, "place",
                {"theta_u": turn, "d_theta_s": error}, "r_s", partial(object_place, turn, error),
            )  # fmt: skip
    for error in TURNS_SOUGHT[::step]:
        yield question(
            f"spatial-I-turn-{error:g}", SPATIAL_VISION, "turn", {"d_theta_s": error}, "theta_u",
            partial(object_turn, error),
        )  # fmt: skip
    groups = {
        "error": (("r_s",), 3.0, 0.02, (0.1, 0.5, 1.0, 1.5, 2.0, 3.0)),
        "r_s": (("d_theta_pc",), 120.0, 1.0, (0.0, 0.25, 0.5, 1.0, 1.5)),
        "r_pc": (("d_theta_pc",), 120.0, 1.0, (0.0, 0.05, 0.1, 0.2, 0.5)),
    }
    for name, (sought, high, resolution, values) in groups.items():
        for value in values[::2] if quick else values:
            chosen = OBJECT.varied((name,), value)
            yield question(
                f"spatial-II-{name}-{value:g}", SPATIAL_CAMERA, name,
                chosen.given(*sought, "low", "high"), sought[0],
                partial(camera_limit, chosen, sought, high, resolution),
            )  # fmt: skip


def planar_place() -> Answer:
    """Analysis I: the largest error of the object's position."""
    return {"found_m": bisected(lambda d: planar_margin(0.0, d) > 0.0, 4.0, 1e-3)}


def planar_turn(error: float, d_error: float, shift: float) -> Answer:
    """Analysis II: the largest turn of the camera with which no value in the boxes fails."""
    limits = PlanarVisionLimits(error, d_error, shift)
    found = bisected(lambda a: limits.worst_margin(math.radians(a)) > 0.0, 90.0, 0.1)
    return {"found_deg": found}


def object_place(turn: float, error: float) -> Answer:
    """Spatial analysis I: the largest error of the object's position, angles in degrees."""
    return {"found_m": worst_object_error(math.radians(turn), math.radians(error))}


def object_turn(error: float) -> Answer:
    """Spatial analysis I: the largest theta, the object's position exact."""
    return {
        "found_deg": bisected(
            lambda turn: worst_object_error(math.radians(turn), math.radians(error)) > 0.0,
            180.0, 1.0,
        )
    }  # fmt: skip


def camera_limit(limits: RobotLimits, sought: tuple[str, ...], high: float, step: float) -> Answer:
    """Spatial analysis II: the largest of the sought limits, by search and by proof."""
    robot = LimitedRobot(ROBOT)
    found = RangeSearch(robot).largest(limits, sought, high, step)
    proof = RangeSearch(robot, "certified").largest(limits, sought, found, step)
    unit = unit_of_limit(sought[0])
    return {f"searched_{unit}": found, f"certified_{unit}": proof}
