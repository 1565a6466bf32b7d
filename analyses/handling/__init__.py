"""Picking and placing: runs of `systems.handling`, what they came to, and pictures of them.

Distances and angles are true ones, of the box in the plant against the goal where it truly is.
"""

from cdpr_drake.analyses.handling.figures import (
    live_view,
    pick_and_place_pictures,
    write_pick_and_place_data,
)
from cdpr_drake.analyses.handling.run import (
    PickAndPlaceRun,
    run_pick_and_place,
    unfinished_pick_and_place,
)
from cdpr_drake.analyses.handling.summary import (
    phase_spans,
    pick_and_place_facts,
    placed_error,
    summarize_pick_and_place,
    unseen,
)

__all__ = [
    "PickAndPlaceRun", "live_view", "phase_spans", "pick_and_place_facts",
    "pick_and_place_pictures", "placed_error", "run_pick_and_place", "summarize_pick_and_place",
    "unfinished_pick_and_place", "unseen", "write_pick_and_place_data",
]  # fmt: skip
