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

AS_IN_FILE, UPPER_ON_UPPER = "as in the robot's file", "upper on upper"
"""Which anchor points the cables of the fully constrained ACROBOT hold: by the numbers of tables
3.1 and A.1, where cables from the floor hold the upper anchor points; or cables from above the
upper ones, each at the corner with the sign of its exit point along x and the other along y."""


@dataclass(frozen=True)
class Recipe:
    """A recipe.

    Attributes:
        name: For --recipe.
        words: What it takes otherwise than `present`.
        anchors: AS_IN_FILE or UPPER_ON_UPPER, for the fully constrained ACROBOT.
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
        x, y, z = cables.p_PB
        above = cables.p_WA[2] > np.mean(cables.p_WA[2])
        side, front, _ = np.sign(cables.p_WA)
        upper_on_upper = np.stack(
            [side * np.abs(x), -front * np.abs(y), np.where(above, z.max(), z.min())]
        )
        return replace(cables, p_PB=upper_on_upper)


VARIED_POINTS = {"acrobot": "corners", "planar": "independent", "caroca": "common"}
"""How points are wrong in the rows that vary them, by the first word of the robot's name."""

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
