"""What of the recipe for the stability tables the thesis says, what was chosen, and on which rows.

A recipe that was chosen with rows in sight cannot be confirmed by them; `chosen_on` says which.
"""

from __future__ import annotations

from dataclasses import dataclass

from cdpr_drake.analyses.published.stability_tables import BASELINE_VALUES

FITTED_TABLES = ("A.8", "A.10", "A.12", "A.14", "A.17")
"""Tables all of whose rows were in sight when the recipe was chosen."""

HYBRID_CAMERA_PLACE = 0.2
"""From this error of the camera's place on, rows of A.15 were in sight [m]."""


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
        "View under 2 1/2 D",
        "nothing",
        "the object 0.45 m ahead and 0.4 m to the side, a rotation error of 120 deg about the "
        "image's x axis, at every pose; the closest of some 300 random views, rounded",
        "A.14 without r_A, r_B and d_theta_pc >= 30 deg; of A.15 the baseline, r_bp = 1 m and r_pc "
        "from 0.2 m on",
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
        "ACROBOT: each at a corner of its own cube; planar: each on its own circle; CAROCA: a "
        "common shift",
        "r_A and r_B of A.8, A.10, A.12, A.17",
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
    if table in FITTED_TABLES:
        return True
    if table != "A.15":
        return False
    baseline = value == BASELINE_VALUES.get(bound)
    camera = bound == "r_pc" and value >= HYBRID_CAMERA_PLACE
    return baseline or camera or (bound, value) == ("r_bp", 1.0)
