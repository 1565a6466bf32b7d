"""Commands that the studio runs for a page, without the page: their forms, and what they left.

A `CommandForm` says which options a command takes; the command line makes it from its own
functions, so that there is no second list of them. `CommandBoard` starts commands in the working
folder, each as a job. `Regions` are workspaces that were computed, as solids and planes for the
scene; `StudyFolder` is what a study left.
"""

from cdpr_drake.studio.commands.command_board import CommandBoard, Computed
from cdpr_drake.studio.commands.command_form import (
    CommandForm,
    CommandOption,
    FieldProblem,
    OptionKind,
)
from cdpr_drake.studio.commands.finished_studies import (
    STUDY_RESULTS,
    StudyFolder,
    study_folder,
    study_folders,
)
from cdpr_drake.studio.commands.regions import (
    PLANE,
    REGIONS,
    Layer,
    Plane,
    Regions,
    draw_plane,
    read_regions,
    show_regions,
)

__all__ = [
    "PLANE", "REGIONS", "STUDY_RESULTS", "CommandBoard", "CommandForm", "CommandOption", "Computed",
    "FieldProblem", "Layer", "OptionKind", "Plane", "Regions", "StudyFolder", "draw_plane",
    "read_regions", "show_regions", "study_folder", "study_folders",
]  # fmt: skip
