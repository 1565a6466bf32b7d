"""Tells a file that was given to the wrong loader, from the keys at its top."""

from __future__ import annotations

from collections.abc import Collection

FILE_KINDS: dict[str, tuple[frozenset[str], str]] = {
    "a robot": (frozenset({"platform", "winch", "tension_bounds"}), "cdpr_drake.models.load_robot"),
    "a scenario": (frozenset({"robot", "duration"}), "cdpr_drake.systems.load_scenario"),
    "a camera": (
        frozenset({"view_angle_horizontal_deg", "view_angle_vertical_deg"}),
        "cdpr_drake.models.load_camera",
    ),
    "perturbation bounds": (
        frozenset({"r_bp", "r_A"}),
        "cdpr_drake.analyses.stability.load_bounds",
    ),
}
"""What files describe: keys that only those have, all of them, and what loads them."""


def other_kind(keys: Collection[str], accepted: Collection[str]) -> str:
    """Words for a file of another kind, with its loader; empty where nothing speaks for one.

    Args:
        keys: Those at the top of the file.
        accepted: Those that the loader knows.
    """
    for what, (marks, loader) in FILE_KINDS.items():
        if marks <= set(keys) and not marks & set(accepted):
            return f"found {what}; use {loader}"
    return ""
