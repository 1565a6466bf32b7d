"""`cdpr export`: a robot in the file of another tool."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.options import AsJson, RobotName
from cdpr_drake.cli.robot_folder import write_files
from cdpr_drake.cli.terminal import print_json
from cdpr_drake.models.robot_exchange import export_robot
from cdpr_drake.models.robot_exports import EXPORTS, export_omissions, omission_words
from cdpr_drake.models.robot_loader import load_robot


def help_words() -> str:
    """The help, with the formats that there are."""
    formats = "\n".join(f"- {name}: {words}" for name, words in EXPORTS.items())
    return (
        "Exports a robot to the format of another tool.\n\n"
        f"{formats}\n\n"
        "What a format cannot hold is left out and named on stderr, field by field; with --json "
        "under not_written, by the fields' keys."
    )


def export(
    robot: RobotName,
    format: Annotated[
        str,
        typer.Option(
            "--format", help=f"One of {', '.join(EXPORTS)}.", autocompletion=words_among(EXPORTS)
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder of the files.")] = Path(),
    overwrite: Annotated[bool, typer.Option(help="Replace files of these names.")] = False,
    as_json: AsJson = False,
) -> None:
    """Exports a robot to the format of another tool."""
    loaded = load_robot(robot, "cdpr export")
    paths = write_files(out, export_robot(loaded, format), overwrite)
    lost = export_omissions(loaded, format)
    if as_json:
        files = [str(path) for path in paths]
        print_json({"robot": loaded.name, "format": format, "files": files, "not_written": lost})
        return
    for words in omission_words(lost):
        typer.echo(words, err=True)
    for path in paths:
        print(path)
