"""`cdpr import`: a robot folder from a file of another tool."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdpr_drake.analyses.front.exchange import import_robot
from cdpr_drake.cli.options import AsJson
from cdpr_drake.cli.robot_folder import write_files
from cdpr_drake.cli.terminal import print_json


def import_(
    file: Annotated[
        Path,
        typer.Argument(
            help="CASPR's bodies or cables file, folder or list of models; wcrfx; the Gazebo "
            "simulator's YAML; GRAB's JSON; SDFormat; URDF; MJCF."
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder for robot.yaml and README.md; the robot's name.")
    ] = None,
    name: Annotated[str | None, typer.Option(help="Name of the robot; the file's.")] = None,
    model: Annotated[
        str | None, typer.Option(help="Name of a model in a CASPR list, models_list.csv.")
    ] = None,
    cable_set: Annotated[
        str | None, typer.Option(help="Set of cables of a CASPR model; its default one.")
    ] = None,
    overwrite: Annotated[bool, typer.Option(help="Replace robot.yaml and README.md.")] = False,
    as_json: AsJson = False,
) -> None:
    """Imports a robot from a file of another tool into a folder.

    The folder gets robot.yaml, which every command takes, and a README that says what came from
    the file, what it lacked and what was assumed. Commands also take the foreign file itself.
    """
    imported = import_robot(file, name=name, model=model, cable_set=cable_set)
    folder = out or Path(imported.robot.name)
    files = {"robot.yaml": imported.yaml(), "README.md": imported.readme()}
    paths = write_files(folder, files, overwrite)
    completed = imported.completed
    if as_json:
        told = imported.as_dict()
        head = {key: told.pop(key) for key in ("robot", "format", "source")}
        print_json({**head, "files": [str(path) for path in paths], **told})
        return
    robot = imported.robot
    print(f"{robot.name}: {robot.motion}, {len(robot.cables)} cables, from {imported.tool}")
    for key, words in completed.assumed.items():
        print(f"  assumed {key}: {words}")
    for words in completed.remarks:
        print(f"  note: {words}")
    for path in paths:
        print(path)
