"""Variants of the recipe for the stability tables: each names what it takes otherwise.

`cdpr study control-stability --recipe NAME` evaluates one on all rows at once; none is better for
meeting rows that it was chosen on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from cdpr_drake.geometry import CableSet
from cdpr_drake.models import load_robot
from cdpr_drake.stability import DIRECTIONS

FULLY_CONSTRAINED = "acrobot_fully_constrained"

AS_IN_FILE, KEPT_CABLES = "as in the robot's file", "kept cables"
UPPER_ON_UPPER, OTHER_CORNERS = "upper on upper", "upper on upper, other corners"
"""Which anchor points the cables of the fully constrained ACROBOT hold.

The exit points of table 3.1 lie in plan exactly where those of table A.1 do, numbered otherwise.
AS_IN_FILE: by the numbers of tables 3.1 and A.1; cables from the floor hold the upper points.
KEPT_CABLES: each cable keeps its anchor point of the suspended robot, and four exit points move
straight down. UPPER_ON_UPPER: cables from above hold the upper points, each at the corner with the
sign of its exit point along x and the other sign along y. OTHER_CORNERS: with the other sign along
x and the same along y.
"""

SUSPENDED = "acrobot_large"

VARIED_POINTS = {"acrobot": "corners", "planar": "independent", "caroca": "common"}
"""How points are wrong in the rows that vary them, by the first word of the robot's name."""


@dataclass(frozen=True)
class Recipe:
    """A recipe.

    Attributes:
        name: For --recipe.
        words: What it takes otherwise than `present`.
        anchors: AS_IN_FILE, KEPT_CABLES, UPPER_ON_UPPER or OTHER_CORNERS.
        points: How points are wrong in the rows that vary them, one of `DIRECTIONS`, by the first
            word of the robot's name, or by its whole name.
    """

    name: str
    words: str
    anchors: str = AS_IN_FILE
    points: Mapping[str, str] = field(default_factory=lambda: dict(VARIED_POINTS))

    def directions(self, robot: str) -> str:
        """How points of a robot are wrong in the rows that vary them."""
        return self.points.get(robot, self.points[robot.split("_")[0]])

    def cables(self, robot: str) -> CableSet:
        """The cables of a robot, without pulleys."""
        cables = load_robot(robot).cable_set().without_pulleys()
        if robot != FULLY_CONSTRAINED or self.anchors == AS_IN_FILE:
            return cables
        if self.anchors == KEPT_CABLES:
            before = load_robot(SUSPENDED).cable_set()
            away = np.linalg.norm(
                cables.p_WA[:2, :, np.newaxis] - before.p_WA[:2, np.newaxis, :], axis=0
            )
            return replace(cables, p_PB=before.p_PB[:, np.argmin(away, axis=1)])
        x, y, z = cables.p_PB
        above = cables.p_WA[2] > np.mean(cables.p_WA[2])
        side, front, _ = np.sign(cables.p_WA)
        sign = 1.0 if self.anchors == UPPER_ON_UPPER else -1.0
        heights = np.where(above, z.max(), z.min())
        p_PB = np.stack([sign * side * np.abs(x), -sign * front * np.abs(y), heights])
        return replace(cables, p_PB=p_PB)


PRESENT = Recipe("present", "the recipe of the study, see its assumptions")

RECIPES = {
    recipe.name: recipe
    for recipe in (
        PRESENT,
        Recipe(
            "upper-on-upper",
            "fully constrained ACROBOT: cables from above hold the upper anchor points",
            anchors=UPPER_ON_UPPER,
        ),
        Recipe(
            "upper-on-upper-independent",
            "the same, and its points wrong each in a direction of its own where they are varied",
            anchors=UPPER_ON_UPPER,
            points={**VARIED_POINTS, FULLY_CONSTRAINED: "independent"},
        ),
        Recipe(
            "other-corners-independent",
            "the same, at the other corners",
            anchors=OTHER_CORNERS,
            points={**VARIED_POINTS, FULLY_CONSTRAINED: "independent"},
        ),
        Recipe(
            "kept-cables",
            "fully constrained ACROBOT: the suspended one's cables, four exit points moved down",
            anchors=KEPT_CABLES,
        ),
        *(
            Recipe(
                f"points-{directions}",
                f"points of every robot wrong by {directions} directions where they are varied",
                points=dict.fromkeys(VARIED_POINTS, directions),
            )
            for directions in DIRECTIONS
        ),
    )
}
"""All of them, by name."""
