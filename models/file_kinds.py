"""Which tool a robot's file is from, told by its ending and content; no reader is imported.

Source: each reader's module.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from functools import lru_cache
from pathlib import Path
from typing import Any

from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.foreign_text import read_text
from cdpr_drake.schema.input_files import input_there
from cdpr_drake.schema.yaml_files import YamlTextError, load_yaml, too_many_bytes

YAML_SUFFIXES = (".yaml", ".yml")
XML_SUFFIXES = (".xml", ".wcrfx", ".sdf", ".world", ".urdf", ".mjcf", ".model")
FIRMWARE_SUFFIXES = (".cfg", ".g", ".gcode")
SUFFIXES = (*YAML_SUFFIXES, *XML_SUFFIXES, *FIRMWARE_SUFFIXES, ".json", ".csv", ".mat")
"""Endings of files that robots are read from."""

MASLOW_SECTION = "MaslowKinematics"

MASLOW_CORNERS = ("tl", "tr", "bl", "br")
"""Names of the cables."""


def is_foreign(path: Path) -> bool:
    """Whether a path is of another tool's format rather than a robot file of this package."""
    if path.suffix.lower() in YAML_SUFFIXES:
        try:
            # One that is too large is refused by the other reader, before it is parsed.
            return not too_many_bytes(path) and _is_foreign_yaml(read_text(path))
        except (OSError, RobotFileError):
            return False  # whose reader says what is wrong with it
    return input_there(path) or not (path / "robot.yaml").is_file()


_MARKS = re.compile(r"\bpoints[\"']?\s*:|maslow", re.IGNORECASE)
"""What a YAML file of another tool has somewhere."""


@lru_cache(32)  # the same robots are read again and again
def _is_foreign_yaml(text: str) -> bool:
    if not _MARKS.search(text):  # nearly all, which are not parsed for it
        return False
    try:
        content = load_yaml(text)
        return is_gazebo_yaml(content) or is_maslow(content)
    except YamlTextError:
        return False


def firmware_of(path: Path) -> str | None:
    """Format of `cdpr export` of a firmware's configuration; None of all other files."""
    suffix = path.suffix.lower()
    if suffix in FIRMWARE_SUFFIXES:
        return "klipper" if suffix == ".cfg" else "reprapfirmware"
    if suffix in YAML_SUFFIXES and is_foreign(path) and is_maslow(load_yaml(read_text(path))):
        return "maslow"
    return None


def is_caspr(root: ET.Element) -> bool:
    """Whether the root of an XML file is one of CASPR's bodies or cables."""
    return root.tag in ("bodies_system", "links", "cables")


def is_wirex(root: ET.Element) -> bool:
    """Whether the root of an XML file is a document of WireX."""
    return root.tag in ("models", "robot") and next(root.iter("chain"), None) is not None


def is_mjcf(root: ET.Element) -> bool:
    """Whether the root of an XML file is MJCF."""
    return root.tag == "mujoco"


def is_sdformat(root: ET.Element) -> bool:
    """Whether the root of an XML file is SDFormat."""
    return root.tag == "sdf"


def is_urdf(root: ET.Element) -> bool:
    """Whether the root of an XML file is URDF."""
    return root.tag == "robot" and root.find("link") is not None


def is_gazebo_yaml(content: Any) -> bool:
    """Whether a YAML document is a robot of the Gazebo simulator."""
    if not isinstance(content, dict):
        return False
    body = content.get("model", content)
    return isinstance(body, dict) and {"points", "platform"} <= set(body)


def is_maslow(content: Any) -> bool:
    """Whether a YAML document is a machine of Maslow."""
    return isinstance(content, dict) and maslow_settings(content) is not None


def maslow_settings(content: dict[Any, Any]) -> dict[str, Any] | None:
    """Anchors and the like of a Maslow by their names without Maslow_; None: there are none."""
    kinematics = content.get("kinematics")
    if isinstance(kinematics, dict) and isinstance(kinematics.get(MASLOW_SECTION), dict):
        return {str(key): value for key, value in kinematics[MASLOW_SECTION].items()}
    start = "maslow_"
    old = {
        str(key)[len(start) :]: value
        for key, value in content.items()
        if str(key).lower().startswith(start)
    }
    return old if any(f"{corner}X" in old for corner in MASLOW_CORNERS) else None
