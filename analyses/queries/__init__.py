"""Questions about a robot at one pose: tensions, rest; numbers, and pictures of them.

Pictures are imported when they are asked for, since that takes longer than the answers.
"""

from typing import TYPE_CHECKING, Any

from cdpr_drake.analyses.queries.equilibria_query import (
    EquilibriaReport,
    rests_at_lengths,
    rests_at_position,
    rests_elastic,
)
from cdpr_drake.analyses.queries.static_query import StaticReport, at_lengths, at_pose
from cdpr_drake.analyses.queries.tension_query import (
    applicable_methods,
    as_dict,
    polygon_tensions,
    solve_all,
    underactuated_answer,
)

if TYPE_CHECKING:
    from cdpr_drake.analyses.queries.figures import polygon_figure, static_figure

__all__ = [
    "EquilibriaReport", "StaticReport", "applicable_methods", "as_dict", "at_lengths", "at_pose",
    "polygon_figure", "polygon_tensions", "rests_at_lengths", "rests_at_position", "rests_elastic",
    "solve_all", "static_figure", "underactuated_answer",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name in ("polygon_figure", "static_figure"):
        from cdpr_drake.analyses.queries import figures

        return getattr(figures, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
