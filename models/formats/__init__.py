"""Robots in the files of other tools: read into drafts, completed, and written.

A `RobotDraft` holds what a file says, in SI units and frames W and P; `complete_draft` makes the
content of a robot file of it and says what the file lacked and what was assumed. Readers never
guess silently: what they leave out or read otherwise is a remark of the draft.

Source: each reader's module.
"""

from cdpr_drake.models.formats.assumptions import CompletedDraft, complete_draft
from cdpr_drake.models.formats.caspr import short_name
from cdpr_drake.models.formats.caspr_writer import write_caspr
from cdpr_drake.models.formats.detection import SUFFIXES, is_foreign, read_foreign
from cdpr_drake.models.formats.draft import DraftCable, RobotDraft
from cdpr_drake.models.formats.gazebo_yaml import write_gazebo_yaml
from cdpr_drake.models.formats.joint_chains import write_sdformat, write_urdf
from cdpr_drake.models.formats.mjcf import write_mjcf
from cdpr_drake.models.formats.named_frames import is_frame_name
from cdpr_drake.models.formats.reading import near_file, robot_name
from cdpr_drake.models.formats.wirex import write_wirex

__all__ = [
    "SUFFIXES", "CompletedDraft", "DraftCable", "RobotDraft", "complete_draft", "is_foreign",
    "is_frame_name", "near_file", "read_foreign", "robot_name", "short_name", "write_caspr",
    "write_gazebo_yaml", "write_mjcf", "write_sdformat", "write_urdf", "write_wirex",
]  # fmt: skip
