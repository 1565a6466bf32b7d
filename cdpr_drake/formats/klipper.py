"""Klipper's configuration of printers on winches: `kinematics: winch`.

Each section [stepper_a], [stepper_b], ... has the anchor of a cable, `anchor_x`, `anchor_y`,
`anchor_z` [mm]; `rotation_distance` is the cable of one turn of the drum [mm], behind `gear_ratio`
as 57:11, 2:1. Cables end in one point, and lengths count from where that is at the origin. Of
firmware that compensates for flex, [winch] has `mover_weight`, the mass of what moves [kg].

Source: klipper3d.org, Config_Reference, cable winch kinematics; config/example-winch.cfg.
"""

from __future__ import annotations

import configparser
import re
from pathlib import Path

import numpy as np

from cdpr_drake.formats.draft import DraftCable, RobotDraft, deviation_lines
from cdpr_drake.models.foreign_text import fail, number, read_text, robot_name

TOOL = "Klipper winch configuration"

MM = 1e-3

LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
"""Names of the cables: Klipper has stepper_a to stepper_z."""

LEAST = 3
"""Winches that Klipper asks for."""

_KEPT = {"anchor_x", "anchor_y", "anchor_z", "rotation_distance", "gear_ratio"}


def read_klipper(path: Path) -> RobotDraft:
    """Reads a point mass on winches; pins and settings of its electronics are left out.

    Raises:
        RobotFileError: The file does not describe one; says where.
    """
    text = read_text(path).partition("\n#*#")[0]  # what Klipper saves itself
    parser = configparser.RawConfigParser(
        strict=False, inline_comment_prefixes=(";", "#"), allow_no_value=True
    )
    try:
        parser.read_string(text)
    except configparser.Error as problem:
        words = " ".join(str(problem).split())[:160]
        raise fail(path, "sections", words, "[sections] with key: value") from problem
    kind = parser.get("printer", "kinematics", fallback=None)
    if kind != "winch":
        raise fail(path, "printer.kinematics", kind, "winch")
    draft = RobotDraft(name=robot_name(path.stem), tool=TOOL, title=f"from {path.name}")
    draft.motion = "3T"
    drums: list[tuple[float, float]] = []
    unread: set[str] = set()
    for letter in LETTERS:
        section = f"stepper_{letter.lower()}"
        if not parser.has_section(section):
            break
        given = parser[section]
        draft.cables.append(
            DraftCable(
                name=letter,
                exit_point=MM * np.array(
                    [number(path, f"{section}.anchor_{k}", given.get(f"anchor_{k}")) for k in "xyz"]
                ),
                anchor_point=np.zeros(3),
            )
        )  # fmt: skip
        if "rotation_distance" in given:
            drums.append(_drum(path, section, given))
        unread |= set(given) - _KEPT
    if len(draft.cables) < LEAST:
        found = f"{len(draft.cables)} winches"
        raise fail(path, "stepper_a, stepper_b, ...", found, f"at least {LEAST}")
    draft.home_position = np.zeros(3)
    radii, ratios = [radius for radius, _ in drums], {ratio for _, ratio in drums}
    if len(ratios) == 1 and (len(set(radii)) == 1 or len(radii) == len(draft.cables)):
        usual = max(radii, key=radii.count)
        draft.drum_radius, draft.gear_ratio = usual, ratios.pop()
        for cable, radius in zip(draft.cables, radii, strict=False):
            cable.drum_radius = None if radius == usual else radius
    elif drums:
        draft.remarks.append("Gears differ from winch to winch, for which there is no place here.")
    speed = parser.get("printer", "max_velocity", fallback=None)
    if speed is not None:
        draft.cable_speed = MM * number(path, "printer.max_velocity", speed)
        draft.remarks.append("max_velocity, that of the tool, was taken as that of the cables.")
    weight = parser.get("winch", "mover_weight", fallback=None)
    if weight is not None:
        draft.mass = number(path, "winch.mover_weight", weight)
        if draft.mass <= 0.0:
            raise fail(path, "winch.mover_weight", weight, "above 0 [kg]")
    if unread:
        draft.remarks.append(f"Keys of steppers that were not kept: {', '.join(sorted(unread))}.")
    _other_sections(parser, len(draft.cables), draft)
    return draft


def _other_sections(parser: configparser.RawConfigParser, count: int, draft: RobotDraft) -> None:
    """Remarks on sections and keys that a robot has no place for, and on included files."""
    steppers = {f"stepper_{letter.lower()}" for letter in LETTERS[:count]}
    read = {"printer": {"kinematics", "max_velocity"}, "winch": {"mover_weight"}}
    left, included = [], []
    for section in parser.sections():
        if section.startswith("include "):
            included.append(section.removeprefix("include ").strip())
        elif section not in steppers:
            keys = set(parser[section]) - read.get(section, set())
            whole = section not in read
            left += [section] if whole else [f"{section}.{key}" for key in sorted(keys)]
    if included:
        draft.remarks.append(f"Included files were not read: {', '.join(included)}.")
    if left:
        draft.remarks.append(f"Not kept: {', '.join(left)}.")


def _drum(path: Path, section: str, given: configparser.SectionProxy) -> tuple[float, float]:
    """Radius [m], and motor turns per drum turn."""
    distance = number(path, f"{section}.rotation_distance", given["rotation_distance"])
    if distance <= 0.0:
        raise fail(path, f"{section}.rotation_distance", distance, "above 0 [mm]")
    ratio = 1.0
    words = given.get("gear_ratio") or ""
    for part in filter(None, (word.strip() for word in words.split(","))):
        found = re.fullmatch(r"([\d.]+)\s*:\s*([\d.]+)", part)
        try:
            top, bottom = (float(found[1]), float(found[2])) if found else (0.0, 0.0)
        except ValueError:
            top = bottom = 0.0
        if not (top > 0.0 and bottom > 0.0):
            raise fail(path, f"{section}.gear_ratio", words, "motor:drum, as 57:11, 2:1")
        ratio *= top / bottom
    return distance * MM / (2.0 * np.pi), ratio


def write_klipper(draft: RobotDraft) -> str:
    """Sections of a configuration: kinematics, anchors and drums, without pins.

    It holds exit points, drum radii, gear ratio and the speed of the cables, as that of the tool.
    """
    lines = [
        "# Cable winch kinematics. Pins, microsteps and max_accel are the machine's own.",
        "[printer]",
        "kinematics: winch",
        f"max_velocity: {_mm(draft.cable_speed)}",
    ]
    for letter, cable in zip(LETTERS, draft.cables, strict=False):
        lines += ["", f"[stepper_{letter.lower()}]"]
        radius = draft.drum_radius if cable.drum_radius is None else cable.drum_radius
        if radius is not None:
            lines += deviation_lines("#", "rotation_distance", 2.0 * np.pi * cable.radius_std)
            lines.append(f"rotation_distance: {_mm(2.0 * np.pi * radius)}")
            lines.append(f"gear_ratio: {draft.gear_ratio!r}:1")
        point = cable.exit_point - cable.anchor_point
        for axis, value, std in zip("xyz", point, cable.point_std, strict=True):
            lines += deviation_lines("#", f"anchor_{axis}", std)
            lines.append(f"anchor_{axis}: {_mm(value)}")
    return "\n".join(lines) + "\n"


def _mm(value: float | None) -> str:
    return repr(float(value or 0.0) / MM + 0.0)
