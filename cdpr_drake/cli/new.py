"""`cdpr new`: a commented file to start from."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any

import typer
import yaml

from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.robot_folder import write_files
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot, robot_text
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.templates import commented_yaml
from cdpr_drake.systems.diagrams.load import SCENARIO_SCHEMAS, load_scenario
from cdpr_drake.systems.scenarios.files import resolve_robot_path, scenario_file, scenario_kind
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO
from cdpr_drake.systems.worlds.settings import found_file

ROBOT, SCENARIO = "robot", "scenario"
EXAMPLE = "acrobot_large"
"""The robot that a new one begins as."""

_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}")


def new(
    kind: Annotated[
        str,
        typer.Argument(help="robot or scenario.", autocompletion=words_among((ROBOT, SCENARIO))),
    ],
    name: Annotated[str, typer.Argument(help="Its name; the file is NAME.yaml.")],
    source: Annotated[
        str | None,
        typer.Option(
            "--from", help=f"Robot or scenario to begin as; {EXAMPLE} or {DEFAULT_SCENARIO}."
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder of the file.")] = Path(),
    overwrite: Annotated[bool, typer.Option(help="Replace a file of that name.")] = False,
) -> None:
    """Writes a commented file of a robot or a scenario to edit, and checks it.

    Every key is there with its meaning, unit and range; those with a default are comments.
    """
    if not _NAME.fullmatch(name):
        raise CdprError(
            f"name: found {name}; accepted: 1 to 64 letters, digits, _ . -, the first one no ."
        )
    if kind not in (ROBOT, SCENARIO):
        raise CdprError(f"kind of file: found {kind}; accepted: {ROBOT}, {SCENARIO}")
    of_robot = kind == ROBOT
    schema, content = (
        _robot(source or EXAMPLE) if of_robot else _scenario(source or DEFAULT_SCENARIO)
    )
    content["name"] = name
    head = f"# Check it with `cdpr check {name}.yaml`.\n"
    text = head + commented_yaml(schema, content)
    (path,) = write_files(out, {f"{name}.yaml": text}, overwrite)
    (load_robot if of_robot else load_scenario)(str(path))
    print(path)


def _robot(source: str) -> tuple[type, dict[str, Any]]:
    load_robot(source, "cdpr new")  # for its message, where there is none
    return Robot, yaml.safe_load(robot_text(source))


def _scenario(source: str) -> tuple[type, dict[str, Any]]:
    load_scenario(source)
    path = scenario_file(source)
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    moved = "robot" if "robot" in content else "mechanism"
    content[moved] = resolve_robot_path(path, str(content[moved]))
    for obstacle in (content.get("world") or {}).get("obstacles") or ():
        if obstacle.get("file") is not None:
            obstacle["file"] = found_file(str(obstacle["file"]), path.parent)
    return SCENARIO_SCHEMAS[scenario_kind(source)][0], content
