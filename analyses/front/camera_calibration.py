"""A camera from images of a board."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from pydrake.common.yaml import yaml_dump_typed
from rich.table import Table

from cdpr_drake.analyses.calibration.camera_report import (
    camera_figure,
    camera_numbers,
    camera_remarks,
    camera_tables,
    fitted_camera,
)
from cdpr_drake.analyses.frame.figures import write_figures
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.front.session import Say, Session
from cdpr_drake.analyses.reporting.deferred_figures import drawing
from cdpr_drake.analyses.reporting.log_files import write_json, write_whole
from cdpr_drake.analyses.reporting.output_folder import results_folder
from cdpr_drake.errors import CameraCalibrationError
from cdpr_drake.models.camera_catalogue import Camera
from cdpr_drake.summaries import Summarized
from cdpr_drake.vision.calibration_boards import CalibrationBoard
from cdpr_drake.vision.camera_fit import HOLD_OUT, CameraFit, View, fit_camera

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CAMERA, RESULTS = "camera.yaml", "results.json"
"""Files of a results folder."""

RATE = 30.0
"""Images per second of a camera's file, where nothing is said [Hz]."""

OPTIONS = ("hold_out", "keep_outliers", "name", "rate", "overwrite", "formats")


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class CameraCalibration(Summarized):
    """A camera that was fitted to images of a board.

    Attributes:
        fit: Parameters, standard deviations, residuals.
        camera: The camera, as its file has it.
        unseen: Images in which no board was found.
        folder: Where it was written; None: nowhere.
        failed: Of each figure that could not be written, the file and why.
    """

    fit: CameraFit
    camera: Camera
    unseen: tuple[str, ...]
    folder: Path | None = None
    failed: Mapping[str, str] = field(default_factory=dict)

    @property
    def remarks(self) -> list[str]:
        """What should be known of it, a line each."""
        return camera_remarks(self.fit, list(self.unseen))

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        fit = self.fit
        found = zip(fit.names, fit.values, fit.deviations, strict=True)
        return f"Camera {self.camera.name}: lens {fit.model}", [
            ("fitted", f"rms {fit.rms('fitted'):.3g} px"),
            ("held out", f"rms {fit.rms('held out'):.3g} px"),
            ("corners", f"in {100.0 * fit.coverage:.0f} % of the image's cells"),
            ("parameters", ", ".join(f"{n} {v:.5g} +- {s:.2g}" for n, v, s in found)),
            *(("remark", words) for words in self.remarks[:4]),
        ]

    def as_dict(self) -> dict[str, Any]:
        """For JSON, as the command prints it."""
        return camera_numbers(self.fit, self.remarks, self.camera)

    def tables(self) -> Sequence[Table]:
        """Tables for the terminal."""
        return camera_tables(self.fit, self.remarks)

    def plot(self) -> Figure:
        """Corners, residuals, and how each image fits."""
        return camera_figure(self.fit)


@verb()
def calibrate_camera(
    images: Sequence[Path | str | np.ndarray],
    board: CalibrationBoard,
    model: str = "brown_conrady",
    *,
    folder: Path | str | None = None,
    say: Say | None = None,
    session: Session | None = None,
    **options: Any,
) -> CameraCalibration:
    """Finds a camera's intrinsic parameters and its lens in images of a board.

    Args:
        images: Files, or pictures of 8 bits, grey, blue-green-red as of OpenCV, all of one size.
        board: The board as it was printed.
        model: Lens: brown_conrady, rational, fisheye or none.
        folder: Where camera.yaml, results.json and the figure are written; None: nowhere.
        say: Called with a line on what is done now.
        session: Instead of it: who follows the calibration.
        options: `hold_out`: share of the images that are predicted only. `keep_outliers`: whether
            images that fit badly count. `name`, `rate`: of the camera's file. `overwrite`,
            `formats`: as for `calibrate`.

    Returns:
        What was found; robots and scenarios take its file as a camera's `model`.

    Raises:
        CameraCalibrationError: Images cannot be read, differ in size, or do not tell the camera.
        OutputFolderError: The folder holds other things, or cannot be written.
    """
    unknown = [name for name in options if name not in OPTIONS]
    if unknown:
        raise CameraCalibrationError(f"{unknown[0]}: unknown; accepted: {', '.join(OPTIONS)}")
    follows = session or Session(say=say)
    name = options.get("name", "calibrated")

    def work(say: Say) -> CameraCalibration:
        views, unseen, size = find_boards(images, board, say)
        say("Fitting the camera")
        fit = fit_camera(
            views, size, model, hold_out=options.get("hold_out", HOLD_OUT),
            keep_outliers=options.get("keep_outliers", False),
        )  # fmt: skip
        source = f"cdpr calibrate-camera, {len(views)} images of a {board.kind} board"
        camera = fitted_camera(fit, name, source, options.get("rate", RATE))
        return CameraCalibration(fit=fit, camera=camera, unseen=tuple(unseen))

    if folder is None:
        with follows.doing("Looking for boards") as told:
            return work(told)
    with (
        results_folder(Path(folder), options.get("overwrite", False), redo=True) as results,
        follows.doing("Looking for boards") as told,
    ):
        follows.opened(results)
        found = work(told)
        write_json(results.path / RESULTS, found.as_dict())
        write_whole(results.path / CAMERA, yaml_dump_typed(found.camera))
        place = results.publish()
        told("figures")
        with drawing(place):
            failed = write_figures(
                place, {"camera": found.plot}, options.get("formats", DEFAULT_FORMATS)
            )
    return replace(found, folder=place, failed=failed)


def find_boards(
    images: Sequence[Path | str | np.ndarray], board: CalibrationBoard, say: Say
) -> tuple[list[View], list[str], tuple[int, int]]:
    """The board in each image, names of images without it, and their width and height [px].

    Raises:
        CameraCalibrationError: An image cannot be read, or has another size than the first.
    """
    views: list[View] = []
    unseen: list[str] = []
    size: tuple[int, int] | None = None
    for number, image in enumerate(images):
        name = f"image {number + 1}" if isinstance(image, np.ndarray) else Path(image).name
        say(f"Looking for boards, {number + 1} of {len(images)}")
        gray = _gray(image, name)
        here = (gray.shape[1], gray.shape[0])
        size = size or here
        if here != size:
            raise CameraCalibrationError(
                f"{name}: found {here[0]} x {here[1]} pixels; accepted: those of the first image, "
                f"{size[0]} x {size[1]}"
            )
        found = board.find(gray)
        if found is None:
            unseen.append(name)
        else:
            views.append(View(name, *found, board.together))
    if size is None:
        raise CameraCalibrationError("images: found none; accepted: files of images")
    return views, unseen, size


def _gray(image: Path | str | np.ndarray, name: str) -> np.ndarray:
    if isinstance(image, np.ndarray):
        if image.dtype != np.uint8 or image.ndim not in (2, 3):
            raise CameraCalibrationError(
                f"{name}: found {image.dtype} of shape {image.shape}; accepted: 8 bits, of shape "
                "(height, width) or (height, width, 3)"
            )
        return image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))
    picture = cv2.imread(str(image), cv2.IMREAD_GRAYSCALE) if Path(image).is_file() else None
    if picture is None:
        raise CameraCalibrationError(f"{image}: found no image; accepted: a file that OpenCV reads")
    return np.asarray(picture)
