"""Figures and pages that runs and studies share: style, cables in space, the replay of a run."""

from cdpr_drake.analyses.pictures.cable_figures import cable_figure, draw_cables
from cdpr_drake.analyses.pictures.curves import (
    by_pieces,
    draw_bars,
    draw_curve,
    extreme_rows,
    path_rows,
    phase_of,
    shade,
)
from cdpr_drake.analyses.pictures.figure_files import (
    DEFAULT_FORMATS,
    figure_writers,
    save_figure,
    write_figures,
)
from cdpr_drake.analyses.pictures.figure_style import (
    COVERED_LINE,
    bar_style,
    bare_figure,
    few_ticks,
    line_style,
    new_figure,
    plain_numbers,
    styled,
)
from cdpr_drake.analyses.pictures.live_view import (
    Prepare,
    live_pick_and_place,
    live_servo,
    live_tension_control,
)
from cdpr_drake.analyses.pictures.meshcat_window import LOCAL, open_meshcat, page_address
from cdpr_drake.analyses.pictures.path_figures import Path3D, path_figure, set_box
from cdpr_drake.analyses.pictures.replay import (
    RobotPicture,
    frame_indices,
    robot_picture,
    write_replay,
)
from cdpr_drake.analyses.pictures.replay_signals import CameraView
from cdpr_drake.analyses.pictures.robot_gallery import gallery_page, thumbnail
from cdpr_drake.analyses.pictures.shown_things import ShownThing, ShownView, Surroundings
from cdpr_drake.analyses.pictures.solids import draw_solid
from cdpr_drake.analyses.pictures.transparency import add_solid

__all__ = [
    "COVERED_LINE",
    "DEFAULT_FORMATS",
    "LOCAL",
    "CameraView",
    "Path3D",
    "Prepare",
    "RobotPicture",
    "ShownThing",
    "ShownView",
    "Surroundings",
    "add_solid",
    "bar_style",
    "bare_figure",
    "by_pieces",
    "cable_figure",
    "draw_bars",
    "draw_cables",
    "draw_curve",
    "draw_solid",
    "extreme_rows",
    "few_ticks",
    "figure_writers",
    "frame_indices",
    "gallery_page",
    "line_style",
    "live_pick_and_place",
    "live_servo",
    "live_tension_control",
    "new_figure",
    "open_meshcat",
    "page_address",
    "path_figure",
    "path_rows",
    "phase_of",
    "plain_numbers",
    "robot_picture",
    "save_figure",
    "set_box",
    "shade",
    "styled",
    "thumbnail",
    "write_figures",
    "write_replay",
]  # fmt: skip
