"""`cdpr import`: a robot folder from a file of another tool."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_drake.analyses.front.exchange import import_robot
from cdpr_drake.cli.options import AsJson
from cdpr_drake.cli.robot_folder import write_files
from cdpr_drake.cli.terminal import print_json, print_words
from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.formats.assumptions import CompletedDraft
from cdpr_drake.models.formats.caspr import TOOL
from cdpr_drake.models.mechanism_exchange import import_mechanism, is_foreign_mechanism


def import_(
    file: Annotated[
        Path,
        typer.Argument(
            help="CASPR's bodies or cables file, folder or list of models; wcrfx; the Gazebo "
            "simulator's YAML; GRAB's JSON; SDFormat; URDF; MJCF."
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder for the files; default: the robot's name.")
    ] = None,
    name: Annotated[
        str | None, typer.Option(help="Name of the robot; default: that in the file.")
    ] = None,
    model: Annotated[
        str | None, typer.Option(help="Name of a model in a CASPR list, models_list.csv.")
    ] = None,
    cable_set: Annotated[
        str | None,
        typer.Option(help="Set of cables of a CASPR model; default: the model's own default."),
    ] = None,
    repair_inertia: Annotated[
        bool,
        typer.Option(
            help="For links of CASPR: replace moments of inertia that no body can have, and "
            "those of rods without thickness, by the nearest that a body can have; each is "
            "named."
        ),
    ] = False,
    overwrite: Annotated[bool, typer.Option(help="Replace files of these names.")] = False,
    as_json: AsJson = False,
) -> None:
    """Imports a robot from a file of another tool into a folder.

    Writes robot.yaml, which every command takes, and a README that lists what the file states,
    what it lacks and what was assumed. Commands also take the foreign file itself.
    CASPR's models of several links give mechanism.yaml, and MJCF for links and joints.
    """
    if is_foreign_mechanism(file, model):
        mechanism = import_mechanism(
            file, name=name, model=model, cable_set=cable_set, repair_inertia=repair_inertia
        )
        paths = write_files(out or Path(mechanism.name), mechanism.files(), overwrite)
        if as_json:
            _print_json(mechanism.as_dict(), "mechanism", paths)
            return
        tree = mechanism.tree
        print_words(
            f"{mechanism.name}: {len(tree.links)} links, {tree.coordinates} coordinates, "
            f"{len(tree.cables)} cables, from {TOOL}"
        )
        _print_told(mechanism.completed, paths)
        return
    if repair_inertia:
        raise RobotFileError(
            f"--repair-inertia: found with {file}; accepted: with a CASPR model of several links, "
            "or of joints that no platform on cables has"
        )
    imported = import_robot(file, name=name, model=model, cable_set=cable_set)
    folder = out or Path(imported.robot.name)
    files = {"robot.yaml": imported.yaml(), "README.md": imported.readme()}
    paths = write_files(folder, files, overwrite)
    if as_json:
        _print_json(imported.as_dict(), "robot", paths)
        return
    robot = imported.robot
    print_words(f"{robot.name}: {robot.motion}, {len(robot.cables)} cables, from {imported.tool}")
    _print_told(imported.completed, paths)


def _print_json(told: dict[str, Any], kind: str, paths: list[Path]) -> None:
    head = {key: told.pop(key) for key in (kind, "format", "source")}
    print_json({**head, "files": [str(path) for path in paths], **told})


def _print_told(completed: CompletedDraft, paths: list[Path]) -> None:
    for key, words in completed.assumed.items():
        print_words(f"  assumed {key}: {words}")
    for words in completed.remarks:
        print_words(f"  note: {words}")
    for path in paths:
        print_words(path)
