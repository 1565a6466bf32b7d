"""`cdpr new`: a commented file to start from, or a block or study with its test."""

from __future__ import annotations

import keyword
import re
import sys
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_drake.cli.completion import robot_words, words_among
from cdpr_drake.cli.notebooks import FOLDER as NOTEBOOKS
from cdpr_drake.cli.robot_folder import write_files
from cdpr_drake.cli.terminal import message_console
from cdpr_drake.errors import CdprError, plain_words
from cdpr_drake.models.exit_points import split_name
from cdpr_drake.models.robot_loader import load_robot, robot_file, robot_names, robot_text
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.input_files import input_text
from cdpr_drake.schema.templates import commented_yaml
from cdpr_drake.schema.typed_yaml import closest
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
TEMPLATES = NOTEBOOKS / "templates"
EXAMPLE = "acrobot_large"
"""The robot that a new one begins as."""

_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}")


def new(
    kind: Annotated[
        str,
        typer.Argument(help=f"One of {', '.join(KINDS)}.", autocompletion=words_among(KINDS)),
    ],
    name: Annotated[
        str, typer.Argument(help="Name; the file is NAME.yaml, or NAME.py and test_NAME.py.")
    ],
    source: Annotated[
        str | None,
        typer.Option(
            "--from", help=f"Robot or scenario to copy; default: {EXAMPLE} or {DEFAULT_SCENARIO}."
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            help="With scenario: a robot by name or file, for which poses, target and limits are "
            "chosen.",
            autocompletion=robot_words,
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for the file.")] = Path(),
    overwrite: Annotated[bool, typer.Option(help="Replace a file of that name.")] = False,
) -> None:
    """Writes a robot, scenario, controller, estimator or study to start from.

    A robot or scenario file has every key with its meaning, unit and range; keys with a default
    are comments. A scenario for a robot, `--robot`, has the keys that it needs; `cdpr schema
    scenario` lists all. A controller, estimator or study is a program that runs, with a test for
    pytest.
    """
    if not _NAME.fullmatch(name):
        raise CdprError(
            f"name: found {name!r}; accepted: 1 to 64 letters, digits, '_', '.' or '-', not "
            "beginning with '.'"
        )
    if kind not in KINDS:
        raise CdprError(f"kind of file {kind!r} is unknown; {closest(kind, KINDS)}")
    if robot is not None and (kind != SCENARIO or source is not None):
        found = kind if source is None else f"--from {source}"
        raise CdprError(f"--robot: found {robot} with {found}; accepted: with scenario, alone")
    if kind in BLOCKS:
        if source is not None:
            raise CdprError(f"--from: found {source} with {kind}; accepted: with robot, scenario")
        for path in write_files(out, _block(kind, name), overwrite):
            print(plain_words(str(path)))
        return
    of_robot = kind == ROBOT
    remarks: list[str] = []
    head = f"# Check it with `cdpr check {name}.yaml`.\n"
    if robot is not None:
        loaded = load_robot(robot, "cdpr new scenario")
        content, remarks = first_scenario(loaded, name, _reference(robot, out))
        schema = SCENARIO_SCHEMAS[content.get("kind", VISUAL_SERVO)][0]
        head += f"# Made for {loaded.name}. All other keys: `cdpr schema scenario`.\n"
    else:
        schema, content = (
            _robot(source or EXAMPLE) if of_robot else _scenario(source or DEFAULT_SCENARIO)
        )
        content["name"] = name
    text = head + commented_yaml(schema, content, every=robot is None)
    (path,) = write_files(out, {f"{name}.yaml": text}, overwrite)
    (load_robot if of_robot else load_scenario)(str(path))
    for words in remarks:
        message_console().print(words, soft_wrap=True, markup=False, highlight=False)
    print(plain_words(str(path)))


def _block(kind: str, name: str) -> dict[str, str]:
    """Program and test of a block, under its name.

    Raises:
        CdprError: It is no name of a module.
    """
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


def _robot(source: str) -> tuple[type, dict[str, Any]]:
    load_robot(source, "cdpr new")  # for its message, where there is none
    return Robot, _read(source, robot_text(source))


def _read(source: object, text: str) -> dict[str, Any]:
    """What a text says that was accepted before, though perhaps not word by word."""
    try:
        found: dict[str, Any] = load_yaml(text)
    except YamlTextError as problem:
        raise CdprError(problem.at(source)) from problem
    return found


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
