"""`cdpr export`: a robot in the file of another tool."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.options import AsJson, RobotName
from cdpr_drake.cli.robot_folder import write_files
from cdpr_drake.cli.terminal import print_json, print_words
from cdpr_drake.models.mechanism_exchange import export_mechanism
from cdpr_drake.models.mechanism_loader import load_mechanism
from cdpr_drake.models.robot_exchange import export_robot
from cdpr_drake.models.robot_exports import EXPORTS, export_omissions, omission_words
from cdpr_drake.models.robot_loader import load_robot, names_mechanism


def help_words() -> str:
    """The help, with the formats that there are."""
    formats = "\n".join(f"- {name}: {words}" for name, words in EXPORTS.items())
    return (
        "Exports a robot to the format of another tool.\n\n"
        f"{formats}\n\n"
        "What a format cannot hold is left out and named on stderr, field by field; with --json "
        "under not_written, by the fields' keys. Mechanisms go to caspr."
    )


def export(
    robot: RobotName,
    format: Annotated[
        str,
        typer.Option(
            "--format", help=f"One of {', '.join(EXPORTS)}.", autocompletion=words_among(EXPORTS)
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the files.")] = Path(),
    overwrite: Annotated[bool, typer.Option(help="Replace files of these names.")] = False,
    as_json: AsJson = False,
) -> None:
    """Exports a robot to the format of another tool."""
    kind, name, files, lost = _exported(robot, format)
    paths = write_files(out, files, overwrite)
    if as_json:
        told = {kind: name, "format": format, "files": [str(path) for path in paths]}
        print_json({**told, "not_written": lost})
        return
    for words in omission_words(lost):
        typer.echo(words, err=True)
    for path in paths:
        print_words(path)


def _exported(name: str, format: str) -> tuple[str, str, dict[str, str], dict[str, str]]:
    """Kind and name of what is exported, text of its files by name, and what they do not hold."""
    if names_mechanism(name):
        mechanism = load_mechanism(name)
        return "mechanism", mechanism.name, *export_mechanism(mechanism, format)
    robot = load_robot(name, "cdpr export")
    return "robot", robot.name, export_robot(robot, format), export_omissions(robot, format)
