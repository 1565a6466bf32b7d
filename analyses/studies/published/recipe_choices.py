"""What of the recipe for the stability tables the thesis says, what was chosen, and on which rows.

A recipe that was chosen with rows in sight cannot be confirmed by them; `chosen_on` says which.
"""

from __future__ import annotations

from dataclasses import dataclass

FITTED_TABLES = ("A.8", "A.10", "A.11", "A.12", "A.14", "A.15", "A.17")
"""Tables all of whose rows were in sight when the recipe was chosen."""


@dataclass(frozen=True)
class RecipeChoice:
    """One choice of the recipe.

    Attributes:
        what: What was to be chosen.
        text: What the thesis says of it.
        chosen: What was chosen.
        rows: With which rows in sight.
    """

    what: str
    text: str
    chosen: str
    rows: str


CHOICES = (
    RecipeChoice(
        "What is perturbed",
        "bounds on the estimates (3.3.1): the estimate is perturbed, the truth is nominal",
        "as said",
        "none",
    ),
    RecipeChoice(
        "Draws per pose",
        "nothing",
        "50, 1000 for the planar robot, each error at its full size in a direction of its own",
        "A.8, A.10, A.12",
    ),
    RecipeChoice(
        "Goal of PBVS",
        "from any pose to any other; nothing on which",
        "spatial robots go to the lower corner of the grid's box, theta u is half a turn about z; "
        "the planar one to the opposite corner of a square of half-size 0.55 m",
        "A.8 (the square), A.10, A.12",
    ),
    RecipeChoice(
        "Goal of PBVS on the fully constrained ACROBOT",
        "from any pose to any other; nothing on which",
        "the centre of the grid's box, theta u as above",
        "A.11",
    ),
    RecipeChoice(
        "View under 2 1/2 D",
        "nothing",
        "the object on the optical axis, 0.46 m ahead, half a turn about the axis to go as under "
        "PBVS, at every pose",
        "A.14, A.15",
    ),
    RecipeChoice(
        "Camera on the platform",
        "mounted facing the ground; its place on ACROBOT's small platform (A.6.1), which is not "
        "the one chosen",
        "facing down, 0.08 m above the origin of ACROBOT's platforms, 0.2 m above CAROCA's, for "
        "all schemes",
        "A.14, A.15",
    ),
    RecipeChoice(
        "Points of the fully constrained ACROBOT",
        "table 3.1 and table A.1, by their numbers",
        "the same with A4 and A6 in each other's place",
        "A.11; its rows of r_bp alone choose the same exchange, or its mirror image",
    ),
    RecipeChoice(
        "How points are wrong where they are not varied",
        "each point's error within a sphere (3.3.1)",
        "one common shift of all exit points, one of all anchor points",
        "A.8, A.10, A.12",
    ),
    RecipeChoice(
        "How points are wrong where they are varied",
        "each point's error within a sphere (3.3.1)",
        "ACROBOT: each at a corner of its own cube; planar and fully constrained: each on its own "
        "circle or sphere; CAROCA: a common shift",
        "r_A and r_B of A.8, A.10, A.11, A.12, A.17",
    ),
    RecipeChoice(
        "Volume",
        "the volume of a shape; nothing on which",
        "cells with all corners stable",
        "A.10, A.12",
    ),
)
"""All choices. Not recorded: which single rows of the tables that are not in `FITTED_TABLES` were
at hand, too; there were a few."""


def chosen_on(table: str, bound: str, value: float) -> bool:
    """Whether a row was in sight when the recipe was chosen, as far as that was recorded.

    Args:
        table: Name of the table.
        bound: Name of the bound, angles with _deg.
        value: Its value [m, deg].
    """
    del bound, value  # whole tables were in sight
    return table in FITTED_TABLES
