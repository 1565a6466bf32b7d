"""Files to start from: robots, scenarios, blocks, studies; notebooks; examples."""

from __future__ import annotations

import keyword
import re
import sys
from dataclasses import dataclass
from importlib.metadata import packages_distributions
from json import dumps
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from cdpr_drake.analyses.frame.files import WrittenFiles, write_files
from cdpr_drake.analyses.frame.result import Result
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import NewFolder, RobotWord, one_of
from cdpr_drake.analyses.programs import NOTEBOOKS
from cdpr_drake.errors import CdprError
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.robot_loader import (
    load_robot,
    robot_file,
    robot_names,
    robot_text,
    split_name,
)
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.input_files import input_text
from cdpr_drake.schema.json_schemas import commented_yaml, json_schema
from cdpr_drake.schema.yaml_files import YamlTextError, load_yaml
from cdpr_drake.systems.diagrams.first_scenario import first_scenario
from cdpr_drake.systems.diagrams.load import SCENARIO_SCHEMAS, load_scenario
from cdpr_drake.systems.scenarios.files import (
    VISUAL_SERVO,
    resolve_robot_path,
    scenario_file,
    scenario_kind,
)
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO
from cdpr_drake.systems.worlds.settings import found_file

ROBOT, SCENARIO = "robot", "scenario"
BLOCKS = ("controller", "estimator", "study")
"""What there is a template of, each with its test."""

KINDS = (ROBOT, SCENARIO, *BLOCKS)

FILES = (ROBOT, "mechanism", SCENARIO)
"""Kinds of files that have a schema."""

TEMPLATES = NOTEBOOKS / "templates"

EXAMPLE_ROBOT = "acrobot_large"
"""The robot that a new one begins as."""

_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}")


@verb()
def write_template(
    kind: Annotated[str, one_of(KINDS)], name: str, /, *,
    source: Annotated[str | None, Parameter(name="--from")] = None, robot: RobotWord = None,
    out: NewFolder = Path(), overwrite: bool = False,
) -> WrittenFiles:  # fmt: skip
    """Writes a robot, scenario, controller, estimator or study to start from.

    A robot or scenario file has every key with its meaning, unit and range; keys with a default
    are comments. A scenario for a robot, `--robot`, has the keys that it needs; `cdpr schema
    scenario` lists all. A controller, estimator or study is a program that runs, with a test for
    pytest.

    Args:
        kind: What to write.
        name: Name; the file is NAME.yaml, or NAME.py and test_NAME.py.
        source: Robot or scenario to copy; default: acrobot_large or the scenario that cdpr simulate
            runs.
        robot: With scenario: a robot by name or file, for which poses, target and limits are
            chosen.
        out: Folder for the file.
        overwrite: Replace a file of that name.

    Raises:
        CdprError: The name or an argument is not accepted.
        OutputFolderError: The file is there, or cannot be written.
    """
    if not _NAME.fullmatch(name):
        raise CdprError(
            f"name: found {name!r}; accepted: 1 to 64 letters, digits, '_', '.' or '-', not "
            "beginning with '.'"
        )
    if robot is not None and (kind != SCENARIO or source is not None):
        beside = kind if source is None else f"source {source}"
        raise CdprError(f"robot: found {robot} with {beside}; accepted: with scenario, alone")
    if kind in BLOCKS:
        if source is not None:
            raise CdprError(f"source: found {source} with {kind}; accepted: with robot, scenario")
        return WrittenFiles({"kind": kind}, write_files(out, _block(kind, name), overwrite))
    remarks: list[str] = []
    head = f"# Check it with `cdpr check {name}.yaml`.\n"
    if robot is not None:
        loaded = load_robot(robot, "cdpr new scenario")
        content, remarks = first_scenario(loaded, name, _reference(robot, out))
        schema = SCENARIO_SCHEMAS[content.get("kind", VISUAL_SERVO)][0]
        head += f"# Made for {loaded.name}. All other keys: `cdpr schema scenario`.\n"
    elif kind == ROBOT:
        source = source or EXAMPLE_ROBOT
        load_robot(source, "cdpr new")  # for its message, where there is none
        schema, content = Robot, _read(source, robot_text(source))
    else:
        schema, content = _scenario(source or DEFAULT_SCENARIO)
    content["name"] = name
    text = head + commented_yaml(schema, content, every=robot is None)
    paths = write_files(out, {f"{name}.yaml": text}, overwrite)
    (load_robot if kind == ROBOT else load_scenario)(str(paths[0]))
    return WrittenFiles({"kind": kind}, paths, remarks)


def _block(kind: str, name: str) -> dict[str, str]:
    """Program and test of a block, under its name."""
    if not name.isidentifier() or keyword.iskeyword(name) or name.lower() != name:
        raise CdprError(
            f"name: found {name!r}; accepted: the name of a Python module, of small letters, "
            "digits and _"
        )
    if name in sys.stdlib_module_names or name in packages_distributions():
        raise CdprError(
            f"name: found {name!r}, an installed module, which the file would hide; accepted: "
            "another name"
        )
    title = "".join(part.capitalize() for part in name.split("_")) or "Block"
    files = {}
    for stem, new_name in ((f"mine_{kind}", name), (f"test_mine_{kind}", f"test_{name}")):
        words = (TEMPLATES / f"{stem}.py").read_text(encoding="utf-8")
        words = re.sub(r"\bMine\b", title, re.sub(r"\bmine\b", name, words))
        files[f"{new_name}.py"] = words
    return files


def _read(source: object, text: str) -> dict[str, Any]:
    """Content of a text that was accepted before, though perhaps not word by word."""
    try:
        content: dict[str, Any] = load_yaml(text)
    except YamlTextError as problem:
        raise CdprError(problem.at(source)) from problem
    return content


def _reference(robot: str, out: Path) -> str:
    """How a scenario in a folder names a robot: by name, or by its file, from there if it can."""
    name = split_name(robot)[0]
    if name in robot_names():
        return robot
    file, folder = robot_file(name).absolute(), out.absolute()
    beside = file.is_relative_to(folder) and not file.is_dir()
    return str(file.relative_to(folder) if beside else file) + robot.removeprefix(name)


def _scenario(source: str) -> tuple[type, dict[str, Any]]:
    load_scenario(source)
    path = scenario_file(source)
    content = _read(source, input_text(path))
    moved = "robot" if "robot" in content else "mechanism"
    content[moved] = resolve_robot_path(path, str(content[moved]))
    for obstacle in (content.get("world") or {}).get("obstacles") or ():
        if obstacle.get("file") is not None:
            obstacle["file"] = found_file(str(obstacle["file"]), path.parent)
    return SCENARIO_SCHEMAS[scenario_kind(source)][0], content


@dataclass(frozen=True, repr=False)
class FileSchema(Result):
    """The JSON schema of files of a kind.

    Attributes:
        schema: The schema.
    """

    schema: dict[str, Any]

    def as_dict(self) -> dict[str, Any]:
        """The schema."""
        return self.schema

    def lines(self) -> list[str]:
        """The schema as JSON."""
        return [dumps(self.schema, indent=2)]


@verb()
def file_schema(kind: Annotated[str, one_of(FILES)], /) -> FileSchema:
    """Prints the JSON schema of robot, mechanism or scenario files, for editors.

    Args:
        kind: Which files; of scenarios, the schema asks for what the `kind` in the file needs.
    """
    if kind != SCENARIO:
        schema = json_schema(Robot if kind == ROBOT else Mechanism, f"{kind} of cdpr_drake")
        return FileSchema(schema)
    kinds = {
        name: json_schema(schema, f"scenario of cdpr_drake, {name}")
        for name, (schema, _) in SCENARIO_SCHEMAS.items()
    }
    dialect = next(iter(kinds.values()))["$schema"]
    first, *others = [
        (name, {key: value for key, value in of_kind.items() if key != "$schema"})
        for name, of_kind in kinds.items()
    ]
    schema = first[1]
    for name, other in others:
        condition = {"properties": {"kind": {"const": name}}, "required": ["kind"]}
        schema = {"if": condition, "then": other, "else": schema}
    return FileSchema({"$schema": dialect, "title": "scenario of cdpr_drake", **schema})
