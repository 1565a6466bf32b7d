"""`cdpr replay`: a log of a machine beside a model of it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdpr_drake.analyses.front.logs import replay_log
from cdpr_drake.analyses.logs.log_formats import AUTO
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.cli.completion import robot_words
from cdpr_drake.cli.import_log import Axes, Body, LogFormat, Mapping, Rate, Units, log_request
from cdpr_drake.cli.options import FigureFormats, Overwrite, ResultsAsJson, parse_formats
from cdpr_drake.cli.terminal import print_json, print_words


def replay(
    log: Annotated[Path, typer.Argument(help="Log, as import-log writes or reads it.")],
    robot: Annotated[str, typer.Option(help="Robot of the log.", autocompletion=robot_words)],
    fit_frame: Annotated[
        bool,
        typer.Option(
            help="Fit the tracker's frame to the positions that the model has for the measured "
            "lengths; without, the tracker measures in W."
        ),
    ] = False,
    follow: Annotated[
        bool,
        typer.Option(help="Also drive the simulated robot with the log's cable lengths."),
    ] = False,
    log_format: LogFormat = AUTO,
    unit: Units = None,
    mapping: Mapping = None,
    rate: Rate = None,
    body: Body = None,
    axes: Axes = None,
    out: Annotated[
        Path | None, typer.Option(help="Results folder; default: a new one below runs/.")
    ] = None,
    overwrite: Overwrite = False,
    figure_format: FigureFormats = "png",
    as_json: ResultsAsJson = False,
) -> None:
    """Replays a log of a machine beside a model of it, with residuals by cable.

    Writes replay.html with the measured run and the model's platform, residuals, replay.csv and
    summary.json. Compares lengths at the measured poses, poses from the measured lengths, and
    tensions with those that carry the weight. With --follow the simulated robot follows the log's
    lengths; its distance from the measured poses is the error between simulation and machine.
    """
    formats = parse_formats(figure_format)
    request = log_request(robot, None, unit, mapping=mapping, rate=rate, body=body, axes=axes)
    folder = out if out is not None else free_folder(Path("runs") / f"replay-{log.stem}")
    found = replay_log(
        log, robot, request, format=log_format, fit_frame=fit_frame, follow=follow, folder=folder,
        overwrite=overwrite, formats=formats,
    )  # fmt: skip
    if as_json:
        print_json(found.as_dict())
        return
    print_words(found)
    print_words(f"results: {folder}")
