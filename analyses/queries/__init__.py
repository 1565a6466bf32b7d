"""Questions about a robot at one pose: tensions, rest."""

from cdpr_drake.analyses.queries.figures import static_figure
from cdpr_drake.analyses.queries.static_query import StaticReport, at_lengths, at_pose
from cdpr_drake.analyses.queries.tension_query import (
    applicable_methods,
    as_dict,
    polygon_figure,
    polygon_tensions,
    solve_all,
)

__all__ = [
    "StaticReport", "applicable_methods", "as_dict", "at_lengths", "at_pose", "polygon_figure",
    "polygon_tensions", "solve_all", "static_figure",
]  # fmt: skip
