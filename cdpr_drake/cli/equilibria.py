"""`cdpr equilibria`: all poses at which a robot rests."""

from __future__ import annotations

from typing import Annotated

import numpy as np
import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.analyses.front.statics import EQUILIBRIA_MODELS, find_equilibria
from cdpr_drake.analyses.statics.equilibria_query import EquilibriaReport
from cdpr_drake.arrays import Array
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.options import AsJson, RobotName, named_options, parse_numbers
from cdpr_drake.cli.terminal import message_console, print_json, wide_console, working
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.robot_loader import load_robot

OPTIONS = {
    "lengths": "--lengths", "position": "--position", "taut": "--taut", "model": "--cable-model",
    "searches": "--searches", "seed": "--seed",
}  # fmt: skip
"""Options by the arguments of `find_equilibria`."""


def equilibria(
    robot: RobotName,
    lengths: Annotated[
        str | None, typer.Option(help="Cable lengths from A to B, l1,...,lm [m].")
    ] = None,
    position: Annotated[
        str | None, typer.Option(help="Position of the platform, x,y,z [m], instead of --lengths.")
    ] = None,
    taut: Annotated[
        str | None,
        typer.Option(
            help="Cables that hold the platform at --position, by name; all others are slack."
        ),
    ] = None,
    cable_model: Annotated[
        str,
        typer.Option(
            help="inextensible: all poses, from fixed exit points; elastic: searched.",
            autocompletion=words_among(EQUILIBRIA_MODELS),
        ),
    ] = "inextensible",
    pulleys: Annotated[
        bool,
        typer.Option(
            help="Take the robot's pulleys into account, for elastic cables; --no-pulleys ignores "
            "them, as inextensible cables always do."
        ),
    ] = True,
    searches: Annotated[
        int, typer.Option(help="Largest number of searches, for elastic cables.")
    ] = 1000,
    seed: Annotated[int, typer.Option(help="Seed of the random starts, for elastic cables.")] = 0,
    as_json: AsJson = False,
) -> None:
    """Finds all poses of rest, stable or not, with any cables slack, for lengths or a position."""
    if (position is None) == (lengths is None):
        found = "neither" if position is None else "both"
        raise CdprError(f"--lengths, --position: found {found}; accepted: one of them")
    loaded = load_robot(robot, "cdpr equilibria")
    place, given = None, None
    if position is not None:
        place = parse_numbers("--position", position, (3,), "x,y,z [m]")
    if lengths is not None:
        m = len(loaded.cables)
        given = parse_numbers("--lengths", lengths, (m,), f"{m} lengths [m]")
    holding = None if taut is None else [word.strip() for word in taut.split(",")]
    with working(message_console(), f"{loaded.name} at rest") as say:

        def report(done: int, total: int) -> None:
            what = "searches" if cable_model == "elastic" else "sets of taut cables"
            say(f"{loaded.name} at rest, {done} of {total} {what}")

        with named_options(OPTIONS):
            answer = find_equilibria(
                loaded, given, place, taut=holding, model=cable_model, pulleys=pulleys,
                searches=searches, seed=seed, report=report,
            )  # fmt: skip
    if as_json:
        print_json(answer.as_dict())
    else:
        _print(answer)


def _print(report: EquilibriaReport) -> None:
    console = wide_console(150)
    count = len(report.rests)
    console.print(
        f"{report.robot}: {count} pose{'s' * (count != 1)} of rest, {report.model} cables, "
        f"{report.geometry}"
    )
    table = Table(box=SIMPLE_HEAD)
    for heading in ("position [m]", "angles [deg]", "stability", "energy [J]"):
        table.add_column(heading)
    table.add_column("tensions [N]")
    if report.lengths is None:
        table.add_column("lengths [m]")
    table.add_column("certificate")
    for one, needed in zip(report.rests, report.needed, strict=True):
        angles = np.degrees(angles_from_rotation(one.X_WP.rotation()))
        tensions = ", ".join(
            f"{name} {tension:.4g}"
            for name, tension in zip(report.names, one.tensions, strict=True)
            if tension > 0.0
        )
        words = str(one.certificate)
        if one.radius is not None:
            words += f", alone within {1e3 * one.radius:.2g} mm"
        if one.family:
            words += ", one of a family"
        row = [
            _words(one.X_WP.translation(), 5), _words(angles, 4), str(one.stability),
            f"{one.energy:.5g}", tensions,
        ]  # fmt: skip
        if report.lengths is None:
            row.append(_words(needed, 5))
        table.add_row(*row, words)
    console.print(table)
    console.print("tension 0: not named; " + report.words)


def _words(values: Array, digits: int) -> str:
    """Rounded to nanometres or less, so that no -0 is left."""
    return ", ".join(f"{round(value, 9) + 0.0:.{digits}g}" for value in values)
