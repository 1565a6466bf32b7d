"""Files that users write: everything that is wrong with them, and what a user may want to know."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdpr_drake.analyses.frame.result import Listing
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.errors import CdprError, meant_names
from cdpr_drake.models.mechanism_files import MECHANISM_KEY, SCENARIO_KEY
from cdpr_drake.models.mechanism_loader import load_mechanism
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_loader import (
    load_robot,
    names_mechanism,
    point_notes,
    robot_file,
    robot_names,
)
from cdpr_drake.schema.input_files import input_text
from cdpr_drake.schema.yaml_files import load_yaml, too_many_bytes
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.files import scenario_file, scenario_names

if TYPE_CHECKING:
    from matplotlib.figure import Figure

READERS = (
    "cdpr_drake.analyses.logs.import_log:checked_log",
    "cdpr_drake.formats.robot_exchange:checked_robot",
)
"""Functions that read files of others. Each takes a path and returns what the file is, what a user
may want to know of it, and a log to be drawn, or None if it does not know the file."""

WRONG = 2
"""Exit code if something is wrong with a file."""


@dataclass(frozen=True, repr=False)
class CheckedFiles(Listing):
    """All that is wrong with some files.

    Attributes:
        log: What was read, if one log was checked.
    """

    log: Any = None

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """The log, if one log was checked."""
        return {} if self.log is None else {"log": self.log.plot}


@verb()
def check_files(files: Sequence[Path], /) -> CheckedFiles:
    """Checks files of robots, mechanisms, scenarios; lists every problem; then exit code 2.

    For a log it says which reader reads it and what it contains: rows, gaps, columns, units. What
    the log does not state, cdpr import-log takes as options.

    Args:
        files: Robot or scenario files or names, files of other tools, or logs.
    """
    entries: list[dict[str, Any]] = []
    words: list[str] = []
    logs: list[Any] = []
    for file in files:
        entry: dict[str, Any] = {"file": str(file), "kind": None, "problems": [], "notes": []}
        try:
            entry["kind"], entry["notes"], log = _read(_file_of(file))
            logs.append(log)
            words.append(f"{file}: valid {entry['kind']}")
        except CdprError as problem:
            entry["problems"] = str(problem).split("\n")
            words += entry["problems"]
        words += [f"  note: {note}" for note in entry["notes"]]
        entries.append(entry)
    code = WRONG if any(entry["problems"] for entry in entries) else 0
    return CheckedFiles(
        entries, None, words, code, logs[0] if len(files) == len(logs) == 1 else None
    )


def _read(path: Path) -> tuple[str, list[str], Any]:
    """What a file is, what a user may want to know of it, and a log; raises what is wrong."""
    for reader in READERS:
        module, _, name = reader.partition(":")
        read = getattr(import_module(module), name)(path)
        if read is not None:
            return read
    if _is_scenario(path):
        load_scenario(path)
        return "scenario", [], None
    if names_mechanism(path):
        return "mechanism", _mechanism_notes(path), None
    robot = load_robot(str(path))
    notes = point_notes(robot)
    try:
        hold_robot(robot, robot.home.transform(), robot.cable_set(), "elastic")
    except CdprError as problem:
        notes.append(f"the home pose: {problem}")
    return "robot", notes, None


def _file_of(path: Path) -> Path:
    """A file, or the one of the robot or scenario of this name."""
    if path.exists():
        return path
    name = str(path)
    robots, scenarios = robot_names(), scenario_names()
    if name in robots:
        return robot_file(name)
    if name in scenarios:
        return scenario_file(name)
    hint = "".join(f"; did you mean {near}?" for near in meant_names(name, (*robots, *scenarios)))
    raise CdprError(f"{path}: there is no such file, robot or scenario{hint}")


def _mechanism_notes(path: Path) -> list[str]:
    from cdpr_drake.analyses.statics.static import MechanismAtRest, solve_static

    mechanism = load_mechanism(path)
    try:
        hanging = solve_static(mechanism)
    except CdprError as problem:
        return [f"the home positions: {problem}"]
    assert isinstance(hanging, MechanismAtRest)
    falls = hanging.rest.stability != "stable"
    return [*hanging.rest.notes, *([f"at home it is {hanging.rest.stability}"] if falls else [])]


def _is_scenario(path: Path) -> bool:
    try:
        content = None if too_many_bytes(path) else load_yaml(input_text(path))
    except (OSError, ValueError):
        return False  # the reader of robots says what is wrong
    if not isinstance(content, dict):
        return False
    return "robot" in content or (MECHANISM_KEY in content and SCENARIO_KEY in content)
