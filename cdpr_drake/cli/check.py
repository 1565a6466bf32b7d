"""`cdpr check`: all that is wrong with files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_drake.analyses.front.logs import import_log
from cdpr_drake.analyses.logs.log_formats import detect_log
from cdpr_drake.analyses.statics.static import MechanismAtRest, solve_static
from cdpr_drake.cli.import_log import log_lines
from cdpr_drake.cli.options import AsJson, check_plots, save_plot
from cdpr_drake.cli.terminal import print_json, print_words
from cdpr_drake.errors import CdprError, meant_names
from cdpr_drake.models.formats.file_kinds import is_foreign
from cdpr_drake.models.formats.grab_mat import is_grab_mat
from cdpr_drake.models.mechanism_files import MECHANISM_KEY, SCENARIO_KEY
from cdpr_drake.models.mechanism_loader import load_mechanism
from cdpr_drake.models.robot_exchange import import_robot
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

WRONG = 2

LOG_SUFFIXES = (".csv", ".tsv", ".txt", ".log", ".dat", ".mat", ".py")
"""Endings of files that may be logs; a reader has to know what is in them, too."""


def checked(path: Path) -> dict[str, Any]:
    """What a file is, what is wrong with it, and what a user may want to know."""
    try:
        kind, notes = _read(path)
    except CdprError as problem:
        return {"file": str(path), "kind": None, "problems": str(problem).split("\n"), "notes": []}
    return {"file": str(path), "kind": kind, "problems": [], "notes": notes}


def _read(path: Path) -> tuple[str, list[str]]:
    """What a file is, and notes; raises what is wrong with it."""
    path = _file_of(path)
    if is_log(path):
        told = log_lines(import_log(path))
        return "log, " + told[0].removeprefix(f"{path}: "), [line.strip() for line in told[1:]]
    if is_foreign(path):
        imported = import_robot(path)
        assumed = [f"assumed {key}: {words}" for key, words in imported.completed.assumed.items()]
        told = [*assumed, *imported.completed.remarks, *point_notes(imported.robot)]
        return f"robot, {imported.tool}", told
    if _is_scenario(path):
        load_scenario(str(path))
        return "scenario", []
    if names_mechanism(path):
        return "mechanism", _mechanism_notes(path)
    robot = load_robot(str(path))
    notes = point_notes(robot)
    try:
        hold_robot(robot, robot.home.transform(), robot.cable_set(), "elastic")
    except CdprError as problem:
        notes.append(f"the home pose: {problem}")
    return "robot", notes


def _file_of(path: Path) -> Path:
    """A file, or that of the robot or scenario of this name."""
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


def is_log(path: Path) -> bool:
    """Whether a file is a log of a machine, told by its ending and by a reader that knows it."""
    if path.suffix.lower() not in LOG_SUFFIXES or not path.is_file() or is_grab_mat(path):
        return False
    return detect_log(path) is not None


def _mechanism_notes(path: Path) -> list[str]:
    """What a user may want to know of a mechanism; raises what is wrong with its file."""
    mechanism = load_mechanism(path)
    try:
        found = solve_static(mechanism)
    except CdprError as problem:
        return [f"the home positions: {problem}"]
    assert isinstance(found, MechanismAtRest)
    falls = found.rest.stability != "stable"
    return [*found.rest.notes, *([f"at home it is {found.rest.stability}"] if falls else [])]


def _is_scenario(path: Path) -> bool:
    try:
        content = None if too_many_bytes(path) else load_yaml(input_text(path))
    except (OSError, ValueError):
        return False  # the reader of robots says what is wrong
    if not isinstance(content, dict):
        return False
    return "robot" in content or (MECHANISM_KEY in content and SCENARIO_KEY in content)


def check(
    files: Annotated[
        list[Path],
        typer.Argument(help="Robot or scenario files or names, files of other tools, or logs."),
    ],
    plot: Annotated[
        Path | None, typer.Option(help="File for a figure of the log, where one log is checked.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Checks files of robots, mechanisms, scenarios; lists every problem; then exit code 2.

    For a log it says which reader reads it and what it contains: rows, gaps, columns, units. What
    the log does not state, cdpr import-log takes as options.
    """
    if plot is not None and (len(files) != 1 or not is_log(files[0])):
        raise CdprError(f"--plot: found with {', '.join(map(str, files))}; accepted: with one log")
    check_plots(plot)
    found = [checked(path) for path in files]
    if as_json:
        print_json(found)
    else:
        for item in found:
            for problem in item["problems"]:
                print_words(problem)
            if not item["problems"]:
                print_words(f"{item['file']}: {item['kind']}: nothing wrong")
            for note in item["notes"]:
                print_words(f"  note: {note}")
    if plot is not None and not found[0]["problems"]:
        save_plot(import_log(files[0]).plot(), plot)
    if any(item["problems"] for item in found):
        raise typer.Exit(WRONG)
