"""What reads a file of another tool. Imports all readers: ask `file_kinds` first."""

from __future__ import annotations

from pathlib import Path

from cdpr_drake.errors import RobotFileError
from cdpr_drake.formats.assumptions import complete_draft
from cdpr_drake.formats.caspr import read_caspr
from cdpr_drake.formats.draft import RobotDraft
from cdpr_drake.formats.gazebo_yaml import read_gazebo_yaml
from cdpr_drake.formats.grab import read_grab
from cdpr_drake.formats.grab_mat import read_grab_mat
from cdpr_drake.formats.klipper import read_klipper
from cdpr_drake.formats.maslow import read_maslow
from cdpr_drake.formats.mjcf import read_mjcf
from cdpr_drake.formats.named_frames import read_named_frames
from cdpr_drake.formats.reprapfirmware import read_reprapfirmware
from cdpr_drake.formats.wirex import read_wirex
from cdpr_drake.models.file_kinds import (
    SUFFIXES,
    XML_SUFFIXES,
    YAML_SUFFIXES,
    is_caspr,
    is_maslow,
    is_mjcf,
    is_sdformat,
    is_urdf,
    is_wirex,
)
from cdpr_drake.models.foreign_text import fail, read_xml, read_yaml

_FIRMWARE = {".cfg": read_klipper, ".g": read_reprapfirmware, ".gcode": read_reprapfirmware}

_XML = {is_caspr: read_caspr, is_wirex: read_wirex, is_mjcf: read_mjcf,
        is_sdformat: read_named_frames, is_urdf: read_named_frames}  # fmt: skip


def read_foreign(path: Path, model: str | None = None, cable_set: str | None = None) -> RobotDraft:
    """Reads a robot of another tool, told by the ending and the content of its file.

    Args:
        path: File, or the folder of a CASPR model.
        model: Name of a model in a CASPR list.
        cable_set: Set of cables of a CASPR model; None: its default one.

    Raises:
        RobotFileError: There is no such file, no reader knows it, or it is wrong; one line.
    """
    if not path.exists():
        raise RobotFileError(f"{path}: there is no such file")
    suffix = path.suffix.lower()
    if path.is_dir() or suffix == ".csv":
        return read_caspr(path, model, cable_set)
    if model is not None:
        raise fail(path, "model", model, "a name for lists of models, .csv, only")
    if suffix in YAML_SUFFIXES:
        return _read_yaml(path)
    if suffix == ".json":
        return read_grab(path)
    if suffix == ".mat":
        return read_grab_mat(path)
    if suffix in _FIRMWARE:
        return _FIRMWARE[suffix](path)
    if suffix not in XML_SUFFIXES:
        raise fail(path, "ending", suffix, "one of " + ", ".join(SUFFIXES))
    root = read_xml(path)
    for knows, read in _XML.items():
        if knows(root):
            if read is read_caspr:
                return read_caspr(path, None, cable_set)
            if cable_set is not None:
                break
            return read(path)
    if cable_set is not None:
        raise fail(path, "cable set", cable_set, "a name for CASPR models only")
    raise fail(
        path, "root element", f"<{root.tag}>",
        "a robot of CASPR, WireX, SDFormat, URDF or MJCF",
    )  # fmt: skip


def foreign_yaml(path: Path) -> str:
    """The robot file that the file of another tool makes, as YAML; errors as `read_foreign`."""
    return complete_draft(read_foreign(path)).yaml()


def _read_yaml(path: Path) -> RobotDraft:
    """Maslow's machines, else the Gazebo simulator's robots."""
    return read_maslow(path) if is_maslow(read_yaml(path)) else read_gazebo_yaml(path)
