"""Finds scenario files, and tells what kind of run each describes."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from cdpr_drake.errors import RobotFileError, ScenarioError, accepted_names
from cdpr_drake.models.camera_files import resolved_camera
from cdpr_drake.models.file_kinds import SUFFIXES as ROBOT_SUFFIXES
from cdpr_drake.models.mechanism_files import mechanism_names
from cdpr_drake.models.mechanism_loader import load_mechanism
from cdpr_drake.models.robot_loader import MARK as RAILS_MARK
from cdpr_drake.models.robot_loader import load_robot, robot_file, robot_names
from cdpr_drake.schema.declarations import Refusal, Scope
from cdpr_drake.schema.input_files import input_text, input_there
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.schema.yaml_files import compose_yaml, too_many_bytes

_FOLDER = Path(__file__).parent

VISUAL_SERVO = "visual_servo"
TENSION_CONTROL = "tension_control"
PICK_AND_PLACE = "pick_and_place"
MECHANISM = "mechanism"
KINDS = (VISUAL_SERVO, TENSION_CONTROL, PICK_AND_PLACE, MECHANISM)
"""Kinds of runs; a file without the key `kind` describes a visual servo."""


def scenario_names(kind: str | None = None) -> tuple[str, ...]:
    """Names of the scenarios that come with the package.

    Args:
        kind: One of `KINDS`; None: every kind.

    Raises:
        ScenarioError: There is no such kind.
    """
    names = tuple(sorted(path.stem for path in _FOLDER.glob("*.yaml")))
    if kind is None:
        return names
    if kind not in KINDS:
        raise ScenarioError(f"kind: found {kind!r}; {accepted_names(kind, KINDS)}")
    return tuple(name for name in names if scenario_kind(name) == kind)


@cache
def robot_scenario_names() -> tuple[str, ...]:
    """Names of the scenarios that come with the package and move a robot with one platform."""
    return tuple(name for name in scenario_names() if scenario_kind(name) != MECHANISM)


def check_moves_robot(name: str, asks: str) -> None:
    """Refuses scenarios of mechanisms.

    Args:
        name: Name or path of the scenario.
        asks: What takes robots with one platform only, as in "cdpr serve".

    Raises:
        ScenarioError: It is one of a mechanism, or there is none.
    """
    if scenario_kind(name) == MECHANISM:
        raise ScenarioError(
            f"scenario {name}: kind: found {MECHANISM}; accepted by {asks}: kinds that move a "
            "robot with one platform"
        )


def scenario_file(name: str) -> Path:
    """The file of a scenario.

    Args:
        name: A name of `scenario_names()`, a path that ends in .yaml, or a folder that
            `cdpr simulate` wrote; a folder that is called as a scenario is found as ./NAME.

    Raises:
        ScenarioError: There is no such scenario; says which exist.
    """
    if name.endswith((".yaml", ".yml")):
        path = Path(name)
        if not path.is_file():
            raise ScenarioError(f"{path}: there is no such scenario file")
        return path
    if name not in scenario_names():
        if Path(name).is_dir():
            return _in_folder(Path(name))
        known = closest(name, scenario_names())
        if name in robot_names():
            known = (
                "it is a robot, which cdpr tension, workspace and view take; cdpr new scenario "
                f"mine --robot {name} writes a scenario of it"
            )
        raise ScenarioError(f"scenario {name!r} is unknown; {known}")
    return _FOLDER / f"{name}.yaml"


def _in_folder(folder: Path) -> Path:
    path = folder / "scenario.yaml"
    if not path.is_file():
        raise ScenarioError(
            f"{folder}: found a folder without scenario.yaml; accepted: one that cdpr simulate "
            "wrote, the path of a YAML file, or a name of cdpr scenarios"
        )
    return path


def scenario_kind(name: str) -> str:
    """The kind of a scenario, one of `KINDS`.

    A file that cannot be read as YAML counts as a visual servo; its loader then says what is wrong.

    Raises:
        ScenarioError: Unknown scenario or kind.
    """
    path = scenario_file(name)
    value = top_word(path, "kind")
    if value is None:
        return VISUAL_SERVO
    if value.value not in KINDS:
        raise ScenarioError(
            f"{path}:{value.start_mark.line + 1}: kind: found {value.value}; "
            f"accepted: one of {', '.join(KINDS)}"
        )
    return str(value.value)


def top_word(path: Path, key: str) -> yaml.ScalarNode | None:
    """A word or number at the top of a file; None where it is not there or cannot be read."""
    try:
        if too_many_bytes(path):
            return None
        root = compose_yaml(input_text(path))
    except (OSError, ValueError):
        return None
    for name, value in root.value if isinstance(root, yaml.MappingNode) else ():
        if name.value == key and isinstance(value, yaml.ScalarNode):
            return value
    return None


def unknown_robot(path: Path, overrides: Sequence[str]) -> tuple[str, ...]:
    """What is wrong with the robot's name in a file that has other problems; often nothing."""
    value = top_word(path, "robot")
    if value is None or any(item.partition("=")[0].strip() == "robot" for item in overrides):
        return ()
    try:
        robot_file(resolve_robot_path(path, value.value))
    except RobotFileError as problem:
        return problem.within(f"{path}:{value.start_mark.line + 1}: robot")
    return ()


def resolve_robot_path(scenario_path: Path, robot: str) -> str:
    """The robot's name, or the absolute path of its file: beside the scenario's file, if it is
    there, else as it is found from the working folder."""
    name, mark, rails = robot.rpartition(RAILS_MARK)
    if mark and "=" in rails and "/" not in rails:
        return _resolve(scenario_path, name) + mark + rails
    return _resolve(scenario_path, robot)


def resolve_file_path(scenario_path: Path, file: str) -> str:
    """The absolute path of a file that a scenario names, found as by `resolve_robot_path`."""
    beside = scenario_path.parent / file
    return str((beside if input_there(beside) else Path(file)).absolute())


def _resolve(scenario_path: Path, robot: str) -> str:
    beside = scenario_path.parent / robot
    folder = "/" in robot and (os.path.isdir(beside) or os.path.isdir(robot))
    if not robot.lower().endswith(ROBOT_SUFFIXES) and not folder:
        return robot
    here = input_there(beside) or os.path.isdir(beside)
    return str((beside if here else Path(robot)).absolute())


def robot_scope(scenario: Any, path: Path) -> Scope:
    """What is round a scenario: its robot; names of files in it become absolute paths.

    Raises:
        RobotFileError: Its robot's file, or that of one which is believed in, is not accepted.
    """
    scenario.robot = resolve_robot_path(path, scenario.robot)
    if scenario.world is not None:
        scenario.world.find_files(path.parent)
    try:
        robot = load_robot(scenario.robot, "a scenario")
    except RobotFileError as problem:
        raise RobotFileError(*problem.within(f"{path}: robot")) from problem
    trajectory = getattr(scenario, "trajectory", None)
    if trajectory is not None and getattr(trajectory, "file", None) is not None:
        trajectory.file = resolve_file_path(path, trajectory.file)
    perturbations = getattr(scenario, "perturbations", None)
    camera = getattr(scenario, "camera", None)
    for section, key in ((camera, "model"), (perturbations, "camera_model")):
        if getattr(section, key, None) is not None:
            setattr(section, key, resolved_camera(getattr(section, key), path.parent))
    if perturbations is not None and getattr(perturbations, "believed_robot", None) is not None:
        perturbations.believed_robot = resolve_robot_path(path, perturbations.believed_robot)
        try:
            load_robot(perturbations.believed_robot, "a scenario")
        except RobotFileError as problem:
            where = f"{path}: perturbations.believed_robot"
            raise RobotFileError(*problem.within(where)) from problem
    return Scope(scenario, path, robot)


def mechanism_scope(scenario: Any, path: Path) -> Scope:
    """What is round a scenario of a mechanism: that; its name becomes an absolute path.

    Raises:
        ScenarioError: There is no such mechanism.
        RobotFileError: Its file is not accepted.
    """
    scenario.mechanism = given = resolve_robot_path(path, scenario.mechanism)
    if "/" not in given and given not in mechanism_names():
        raise ScenarioError(
            f"{path}: mechanism: found {given!r}; {closest(given, mechanism_names())}, or a path"
        )
    try:
        return Scope(scenario, path, load_mechanism(given))
    except RobotFileError as problem:
        raise RobotFileError(*problem.within(f"{path}: mechanism")) from problem


def belief_refusals(scope: Scope) -> Iterator[Refusal]:
    """A robot that is believed in and is another than the simulated one."""
    scenario, robot, key = scope.whole, scope.robot, "perturbations.believed_robot"
    if getattr(scenario.perturbations, "believed_robot", None) is None:
        return
    believed = load_robot(scenario.perturbations.believed_robot, "a scenario")
    true, found = len(robot.cables), len(believed.cables)
    if (true, robot.motion) != (found, believed.motion):
        accepted = f"those of {robot.name}, {true} and {robot.motion}"
        yield key, f"{found} cables and {believed.motion}", accepted
    mount = scenario.camera.mount if hasattr(scenario, "camera") else None
    parent, other = (
        next((m.parent for m in one.cameras if m.name == mount), None) for one in (robot, believed)
    )
    if parent is not None and parent != other:
        found_there = f"no camera mounting {mount} on the {parent}"
        yield key, found_there, f"a robot with that of {robot.name}"
