"""Designs of robots: what may change, what is wanted, the search, and whether it came true.

A design is judged as the robot file that it would be: points moved, cables left out, drum and motor
changed. `GOALS` is the table of what may be wanted; volumes are shares of a grid of poses and
steer the search only. What was gained is said by `confirm`, which knows nothing of the search: by
boxes proven inside the workspace, or poses proven stable on another grid.

Source: kinds and measures of workspaces as `analyses.workspaces`; control stability as
`analyses.stability`.
"""

from typing import TYPE_CHECKING, Any

from cdpr_drake.analyses.design.candidates import Candidates, make_candidates
from cdpr_drake.analyses.design.confirmation import Confirmation, confirm
from cdpr_drake.analyses.design.goals import GOALS, Goal
from cdpr_drake.analyses.design.results import DesignResult, write_design
from cdpr_drake.analyses.design.search import (
    DesignSearch,
    judge_original,
    judging_of,
    search_design,
)
from cdpr_drake.analyses.design.settings import (
    SEARCHES,
    DesignSettings,
    GoalSettings,
    MirrorSettings,
    load_design_settings,
)

if TYPE_CHECKING:
    from cdpr_drake.analyses.design.figures import design_figures

__all__ = [
    "GOALS", "SEARCHES", "Candidates", "Confirmation", "DesignResult", "DesignSearch",
    "DesignSettings", "Goal",
    "GoalSettings", "MirrorSettings", "confirm", "design_figures", "judge_original",
    "judging_of", "load_design_settings", "make_candidates", "search_design", "write_design",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name == "design_figures":
        from cdpr_drake.analyses.design import figures

        return figures.design_figures
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
