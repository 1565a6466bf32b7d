"""Two models of the same robot beside each other: modelling errors, cables against rigid rods."""

from cdpr_drake.analyses.comparisons.modelling_errors import (
    errors_figure,
    pose_errors,
    poses_in,
    slack_along_path,
    slack_figure,
    usual_beliefs,
    wrong_geometry,
)

__all__ = [
    "errors_figure", "pose_errors", "poses_in", "slack_along_path", "slack_figure",
    "usual_beliefs", "wrong_geometry",
]  # fmt: skip
