"""Finds, reads and checks robot files, and puts robots elsewhere.

`load_robot` reads one by name or path. Further functions give the same robot somewhere else:
shifted in the world (`moved_robot`), seen from a turned world (`turned_robot`), or with its file in
another folder (`portable_robot`).
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from cdpr_drake.errors import RobotFileError, why_not_read
from cdpr_drake.models.camera_files import resolved_camera
from cdpr_drake.models.file_kinds import SUFFIXES, is_foreign
from cdpr_drake.models.mechanism_files import (
    MECHANISM_FILE,
    is_mechanism,
    is_mechanism_text,
    shipped_mechanism,
    single_platform,
)
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.shapes import FITS, mesh_path
from cdpr_drake.schema.declarations import Scope, number_words
from cdpr_drake.schema.input_files import (
    input_bytes,
    input_text,
    input_there,
    inputs_held,
    made_of_input,
)
from cdpr_drake.schema.typed_yaml import closest, dump_typed, load_typed, parse_typed

_FOLDER = Path(__file__).parent / "robots"

MARK = "@"
"""Between the name of a robot and where its exit points stand on their rails."""

READERS = "cdpr_drake.formats.detection"
"""Module that reads the files of other tools."""


def robot_names() -> tuple[str, ...]:
    """Names of the robots that come with the package."""
    return tuple(sorted(path.parent.name for path in _FOLDER.glob("*/robot.yaml")))


def robot_file(name: str) -> Path:
    """The file of a robot: a name of `robot_names()`, or the path of a file or folder.

    Coordinates of exit points on rails may follow, as in `name@C1=0.3`; they do not change it. A
    folder has a `robot.yaml`, or is a CASPR model; files of other tools are recognised by
    their endings, `ROBOT_SUFFIXES`. It may be that of a mechanism, which `load_mechanism` reads.

    Raises:
        RobotFileError: There is no such robot; says which exist.
    """
    name, _ = split_name(name)
    path = Path(name)
    # One look at the folder and not into each robot's: repeated runs ask again and again.
    is_ours = name in os.listdir(_FOLDER) and (_FOLDER / name / "robot.yaml").is_file()
    held = inputs_held()
    if not is_ours and held is not None and held.knows(path):  # a folder's file, read before
        return path
    if not is_ours and os.path.isdir(path):  # also of a name that is too long
        for own in (path / "robot.yaml", path / MECHANISM_FILE):
            if own.is_file():
                return own
        if any("bod" in child.name.lower() for child in path.glob("*.[xX][mM][lL]")):
            return path
    if name.lower().endswith(SUFFIXES):
        if not input_there(path):
            raise RobotFileError(f"{path}: there is no such robot file")
        return path
    if not is_ours:
        mechanism = shipped_mechanism(name)
        if mechanism is not None:
            return mechanism
        file = path.suffix or "/" in name
        hint = f"; the path of a robot file has to end in {', '.join(SUFFIXES)}" if file else ""
        known = "cdpr robots lists the names" if file else closest(name, robot_names())
        if not file and input_there(Path(f"{name}.yaml")):
            known = f"did you mean {name}.yaml?"
        raise RobotFileError(f"robot {name!r} is unknown; {known}{hint}")
    return _FOLDER / name / "robot.yaml"


def split_name(words: str) -> tuple[str, dict[str, float]]:
    """Name of a robot, and coordinates by cables, of words such as `name@C1=0.3,C2=-0.1`.

    Raises:
        RobotFileError: What stands behind the mark are no coordinates.
    """
    name, mark, rest = words.rpartition(MARK)
    if not mark or "/" in rest or Path(words).exists():  # a path may have the mark in it
        return words, {}
    found: dict[str, float] = {}
    for item in rest.split(","):
        cable, equals, value = item.partition("=")
        try:
            number_ = float(value)
        except ValueError:
            number_ = np.nan
        if not (cable.strip() and equals and np.isfinite(number_)) or cable.strip() in found:
            raise RobotFileError(
                f"robot {words}: found {item!r} behind {MARK}; accepted: coordinates of exit "
                f"points on rails, each cable once, as in {name}{MARK}C1=0.3,C2=-0.1 [m]"
            )
        found[cable.strip()] = number_
    return name, found


def robot_text(name: str, asks: str = "robot_text") -> str:
    """The robot file of a robot as YAML, also where its file is one of another tool.

    Args:
        name: As for `load_robot`.
        asks: What asks, for the refusal of mechanisms.

    Raises:
        RobotFileError: Unknown robot, its file cannot be read, or is that of a mechanism.
    """
    path, (_, rails) = robot_file(name), split_name(name)
    if is_foreign(path):
        content = _foreign_content(path)
    else:
        try:
            content = input_text(path)
        except (OSError, UnicodeDecodeError) as problem:
            raise RobotFileError(f"{path}: cannot be read: {why_not_read(problem)}") from problem
        if is_mechanism_text(content):
            raise single_platform(path, asks)
    if not rails:
        return content
    return dump_typed(_parsed(content, path, rails, lines=not is_foreign(path)))


def _foreign_content(path: Path) -> str:
    """The robot file that the file of another tool makes, as YAML."""
    return made_of_input(path, lambda: import_module(READERS).foreign_yaml(path))


def load_robot(name: str | Path, asks: str = "load_robot") -> Robot:
    """Reads a robot by name or by path, also from a file of another tool.

    What a foreign file lacks is assumed, and stands in the robot's `assumptions`. Exit points on
    rails are where the file says, or where the name does, as in `name@C1=0.3,C2=-0.1` [m].

    Args:
        name: A name of `robot_names()`, or the path of a file or folder.
        asks: What asks, for the refusal of mechanisms.

    Raises:
        RobotFileError: Unknown robot, or the file does not describe a possible one, or a mechanism.
    """
    name = str(name)
    path, (_, rails) = robot_file(name), split_name(name)
    if is_foreign(path):
        return _parsed(_foreign_content(path), path, rails, lines=False)
    if is_mechanism(path):
        raise single_platform(path, asks)
    return load_typed(
        Robot, path, error=RobotFileError, scope=lambda robot: _scope(robot, path, rails)
    )


def names_mechanism(name: Robot | Mechanism | str | Path) -> bool:
    """Whether this is a mechanism, or its name or path; also False where there is no such file."""
    if not isinstance(name, str | Path):
        return isinstance(name, Mechanism)
    try:
        return is_mechanism(robot_file(str(name)))
    except RobotFileError:
        return False


def as_robot(robot: Robot | str | Path, asks: str = "load_robot") -> Robot:
    """A robot that is given as itself, or by name or path as `load_robot` takes it.

    Args:
        robot: The robot.
        asks: What asks, for the refusal of mechanisms.

    Raises:
        RobotFileError: As `load_robot`, or it is something else.
    """
    if isinstance(robot, Robot):
        return robot
    if isinstance(robot, str | Path):
        return load_robot(robot, asks)
    if isinstance(robot, Mechanism):
        raise single_platform(robot.name, asks)
    raise RobotFileError(
        f"robot: found a {type(robot).__name__}; accepted: a name, a path or a Robot"
    )


@contextmanager
def robot_reference(robot: Robot | str | Path, asks: str = "load_robot") -> Iterator[str]:
    """A name or path by which `load_robot` finds a robot inside the block.

    That of a Robot is a file of its own, which goes with the block.

    Raises:
        RobotFileError: It is a Mechanism; `asks` is what asks.
    """
    if isinstance(robot, Mechanism):
        raise single_platform(robot.name, asks)
    if not isinstance(robot, Robot):
        yield str(robot)
        return
    with TemporaryDirectory() as folder:
        path = Path(folder) / "robot.yaml"
        path.write_text(dump_typed(robot), encoding="utf-8")
        input_bytes(path)  # what other processes are sent
        yield str(path)


def parse_robot(content: str, path: Path) -> Robot:
    """A robot from the text of a robot file.

    Args:
        content: YAML.
        path: The file that messages name.

    Raises:
        RobotFileError: The text does not describe a possible robot.
    """
    if is_mechanism_text(content):
        raise single_platform(path, "a robot file")
    return _parsed(content, path, {}, lines=True)


def _parsed(content: str, path: Path, rails: dict[str, float], lines: bool) -> Robot:
    return parse_typed(
        Robot,
        content,
        path,
        error=RobotFileError,
        scope=lambda robot: _scope(robot, path, rails),
        lines=lines,
    )


def _scope(robot: Robot, path: Path, rails: dict[str, float]) -> Scope:
    """Finds files of cameras and mesh, the plane's height, and where exit points stand on rails.

    Raises:
        RobotFileError: A cable has no rail.
    """
    for mount in robot.cameras:
        mount.model = resolved_camera(mount.model, path.parent)
    shape = robot.platform.shape
    if shape is not None and shape.file is not None:
        shape.file = str(mesh_path(shape.file, path.parent) or shape.file)
    is_level = robot.motion in ("2T", "1R2T") and robot.motion_type().axis == (0.0, 0.0, 1.0)
    if is_level and robot.plane_height is None:
        robot.plane_height = float(robot.home.position[2])
    on_rails = {cable.name: cable.rail for cable in robot.cables if cable.rail is not None}
    for name, at in rails.items():
        if name not in on_rails:
            accepted = ", ".join(on_rails) or "none, since its file gives no cables[].rail"
            raise RobotFileError(
                f"{path}: {MARK}{name}: found no rail of that cable; accepted: {accepted}"
            )
        on_rails[name].at = at
    return Scope(robot, path)


def point_notes(robot: Robot) -> list[str]:
    """Remarks on exit points outside a given frame, anchor points outside the platform's box."""
    half, center = np.asarray(robot.platform.size, float) / 2.0, robot.box_center()
    low, high = center - half, center + half
    boxes = {
        "exit points": (robot.exit_points(), *robot.frame.bounds(), "the frame"),
        "anchor points": (robot.anchor_points(), low, high, "the platform's box"),
    }
    notes = []
    for what, (points, lower, upper, where) in boxes.items():
        off = np.maximum(lower[:, np.newaxis] - points, points - upper[:, np.newaxis]).max(axis=0)
        slack = FITS * float(np.max(robot.frame.upper - robot.frame.lower))
        names = [cable.name for cable, d in zip(robot.cables, off, strict=True) if d > slack]
        if names:
            notes.append(
                f"{what} of {', '.join(names)}: up to {off.max():.3g} m outside {where}, "
                f"{number_words(lower)} to {number_words(upper)} m"
            )
    return notes
