"""`cdpr calibrate-camera`: finds a camera's intrinsic parameters and its lens in images."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdpr_drake.analyses.front.camera_calibration import RATE
from cdpr_drake.analyses.front.camera_calibration import calibrate_camera as run_calibration
from cdpr_drake.cli.command_session import CommandSession, shown
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.log_options import STOPPING, ResultsBelowRuns, results_below_runs
from cdpr_drake.cli.options import (
    FigureFormats,
    Overwrite,
    ResultsAsJson,
    named_options,
    parse_formats,
)
from cdpr_drake.cli.run_endings import report_failures
from cdpr_drake.cli.terminal import print_json, wide_console
from cdpr_drake.errors import CdprError
from cdpr_drake.vision.calibration_boards import BOARDS, CalibrationBoard
from cdpr_drake.vision.camera_fit import HOLD_OUT, MODELS

OPTIONS = {
    "squares": "--squares", "size": "--size", "hold_out": "--hold-out", "model": "--model",
    "board": "--board", "marker": "--marker", "markers": "--markers",
}  # fmt: skip
"""Options by the arguments of boards and fits."""


def help_words() -> str:
    """What `cdpr calibrate-camera --help` says above the options."""
    return (
        "Finds a camera's intrinsic parameters and its lens in images of a board.\n\n"
        "IMAGES show one board in at least five ways: tilted against each other, and all over "
        "the image to its corners. A share of them is held out: how the fitted camera explains "
        "those is told beside how it fits the others. Images that fit far worse than the others "
        "are named and left out. Writes camera.yaml, which robots take as the model of a camera "
        "mounting and scenarios as camera.model, results.json and a figure. The exit code is 2 "
        "where images do not tell the camera."
    )


def calibrate_camera(
    images: Annotated[list[Path], typer.Argument(help="Images of the board, all of one size.")],
    squares: Annotated[str, typer.Option(help="Columns x rows of squares, or of tags, as 9x7.")],
    size: Annotated[float, typer.Option(help="Edge of a square, or of a tag [m].")],
    board: Annotated[
        str,
        typer.Option(
            help=f"Kind of board: {', '.join(BOARDS)}.", autocompletion=words_among(BOARDS)
        ),
    ] = BOARDS[0],
    model: Annotated[
        str,
        typer.Option(help=f"Lens: {', '.join(MODELS)}.", autocompletion=words_among(MODELS)),
    ] = MODELS[0],
    marker: Annotated[
        float | None,
        typer.Option(help="Edge of a ChArUco board's markers, gap between tags [m]."),
    ] = None,
    markers: Annotated[
        str | None, typer.Option(help="Dictionary of the markers, as OpenCV names it: 4X4_250.")
    ] = None,
    hold_out: Annotated[
        float, typer.Option(help="Share of the images that are predicted and not fitted.")
    ] = HOLD_OUT,
    keep_outliers: Annotated[bool, typer.Option(help="Count every image as it is.")] = False,
    name: Annotated[str, typer.Option(help="Name of the camera.")] = "calibrated",
    rate: Annotated[float, typer.Option(help="Frame rate of the camera [Hz].")] = RATE,
    out: ResultsBelowRuns = None,
    as_json: ResultsAsJson = False,
    overwrite: Overwrite = False,
    figure_format: FigureFormats = "png",
) -> int:
    """Finds a camera's intrinsic parameters and its lens in images of a board."""
    if not 0.0 < rate <= 1e5:
        raise CdprError(f"--rate: found {rate:g}; accepted: above 0 and at most 100000 [Hz]")
    formats = parse_formats(figure_format)
    columns, rows = _squares(squares)
    folder = results_below_runs(out, f"camera-{name}")
    session = CommandSession(STOPPING, folder)
    with named_options(OPTIONS):
        found = run_calibration(
            images, CalibrationBoard(board, columns, rows, size, marker, markers), model,
            folder=folder, session=session, hold_out=hold_out,
            keep_outliers=keep_outliers, name=name, rate=rate, overwrite=overwrite, formats=formats,
        )  # fmt: skip
    session.say_kept()
    place = shown(found.folder)
    if as_json:
        print_json(found.as_dict())
    else:
        printer = wide_console(140)
        for table in found.tables():
            printer.print(table)
        printer.print(f"results: {place}")
    return report_failures(session.console, found.failed, place, None)


def _squares(words: str) -> tuple[int, int]:
    parts = words.lower().split("x")
    if len(parts) != 2 or not all(part.strip().isdigit() for part in parts):
        raise CdprError(f"--squares: found {words!r}; accepted: columns x rows, as 9x7")
    return int(parts[0]), int(parts[1])
