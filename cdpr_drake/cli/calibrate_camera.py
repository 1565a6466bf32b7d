"""`cdpr calibrate-camera`: finds a camera's intrinsic parameters and its lens in images."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from cdpr_drake.analyses.frame.folder import shown_path
from cdpr_drake.analyses.frame.words import Formats, OutFolder, one_of, words
from cdpr_drake.analyses.front.camera_calibration import RATE
from cdpr_drake.analyses.front.camera_calibration import calibrate_camera as run_calibration
from cdpr_drake.cli.log_options import results_below_runs
from cdpr_drake.cli.sessions import Answer, failures, fit_session
from cdpr_drake.errors import CdprError
from cdpr_drake.vision.calibration_boards import BOARDS, CalibrationBoard
from cdpr_drake.vision.camera_fit import HOLD_OUT, MODELS


def whole_pair(word: str) -> tuple[int, int]:
    """Two whole numbers of 9x7."""
    parts = word.lower().split("x")
    if len(parts) != 2 or not all(part.strip().isdigit() for part in parts):
        raise ValueError(word)
    return int(parts[0]), int(parts[1])


def calibrate_camera(
    images: Annotated[list[Path], Parameter(metavar="IMAGE...")], /, *,
    squares: Annotated[Any, words(whole_pair, "columns x rows, as 9x7", "COLUMNSxROWS")],
    size: float, board: Annotated[str, one_of(BOARDS)] = BOARDS[0],
    model: Annotated[str, one_of(MODELS)] = MODELS[0], marker: float | None = None,
    markers: str | None = None, hold_out: float = HOLD_OUT, keep_outliers: bool = False,
    name: str = "calibrated", rate: float = RATE, out: OutFolder = None, overwrite: bool = False,
    formats: Formats = ("png",),
) -> Answer:  # fmt: skip
    """Finds a camera's intrinsic parameters and its lens in images of a board.

    IMAGES show one board in at least five ways: tilted against each other, and all over the image
    to its corners. A share of them is held out: how the fitted camera explains those is told beside
    how it fits the others. Images that fit far worse than the others are named and left out. Writes
    camera.yaml, which robots take as the model of a camera mounting and scenarios as camera.model,
    results.json and a figure. The exit code is 2 where images do not tell the camera.

    Args:
        images: Images of the board, all of one size.
        squares: Columns x rows of squares, or of tags, as 9x7.
        size: Edge of a square, or of a tag [m].
        board: Kind of board.
        model: Lens.
        marker: Edge of a ChArUco board's markers, gap between tags [m].
        markers: Dictionary of the markers, as OpenCV names it: 4X4_250.
        hold_out: Share of the images that are predicted and not fitted.
        keep_outliers: Count every image as it is.
        name: Name of the camera.
        rate: Frame rate of the camera [Hz].
        out: Results folder; default: a new one below runs/.
        overwrite: Replace results in the folder.
        formats: Files of each figure: png, pdf, svg, or several, as png,pdf.
    """
    if not 0.0 < rate <= 1e5:
        raise CdprError(f"rate: found {rate:g}; accepted: above 0 and at most 100000 [Hz]")
    folder = results_below_runs(out, f"camera-{name}")
    session = fit_session()
    columns, rows = squares
    camera = run_calibration(
        images, CalibrationBoard(board, columns, rows, size, marker, markers), model, folder=folder,
        session=session, hold_out=hold_out, keep_outliers=keep_outliers, name=name, rate=rate,
        overwrite=overwrite, formats=formats,
    )  # fmt: skip
    place = shown_path(camera.folder or folder)
    missing = [f"The data is complete in {place}"] if camera.failed else []
    return Answer(
        numbers=camera.as_dict(), printed=[*camera.tables(), f"results: {place}"],
        words=[*session.kept(), *missing], failed=failures(camera.failed, place),
        drawing=camera.plot,
    )  # fmt: skip
