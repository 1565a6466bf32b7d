"""Figures and pages that runs and studies share: style, cables in space, the replay of a run."""

from cdpr_drake.analyses.pictures.cable_figures import Path3D, cable_figure, path_figure
from cdpr_drake.analyses.pictures.figure_style import (
    COVERED_LINE,
    bare_figure,
    few_ticks,
    figure_writer,
    new_figure,
    plain_numbers,
    save_figure,
)
from cdpr_drake.analyses.pictures.live_view import Prepare, live_servo, live_tension_control
from cdpr_drake.analyses.pictures.meshcat_window import LOCAL, open_meshcat, page_address
from cdpr_drake.analyses.pictures.replay import (
    RobotPicture,
    frame_indices,
    robot_picture,
    write_replay,
)

__all__ = [
    "COVERED_LINE", "LOCAL", "Path3D", "Prepare", "RobotPicture", "bare_figure",
    "cable_figure", "few_ticks",
    "figure_writer", "frame_indices", "live_servo", "live_tension_control", "new_figure",
    "open_meshcat", "page_address", "path_figure", "plain_numbers",
    "robot_picture", "save_figure", "write_replay",
]  # fmt: skip
