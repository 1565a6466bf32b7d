"""A camera's intrinsic parameters and its lens, from images of a board."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import cv2
import numpy as np
from cyclopts import Parameter

from cdpr_drake.analyses.fits.fit import CAMERA, Fit, Unknown, kept_fit, notes_table
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.result import Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Formats,
    OutFolder,
    Switch,
    one_of,
    whole_pair,
    words,
)
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.errors import CameraCalibrationError
from cdpr_drake.models.camera_calibrations import RATE
from cdpr_drake.models.camera_catalogue import Camera, Distortion, fold_refusals
from cdpr_drake.vision.calibration_boards import BOARDS, CalibrationBoard
from cdpr_drake.vision.camera_fit import (
    CELLS,
    CORNER_OUTLIER,
    HOLD_OUT,
    LEAST_OUTLIER,
    MODELS,
    OUTLIER,
    CameraFit,
    View,
    fit_camera,
)
from cdpr_drake.vision.lens_distortion import COEFFICIENTS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROLES = {"fitted": ".", "held out": "x", "outlier": "^"}
"""Roles of images in a fit, and their marks in its figure."""

LEAST_COVERAGE = 0.6
"""Share of an image's cells that corners should lie in."""

LEAST_REACH = 0.85
"""Share of the way to a corner of the image, beyond which a lens is guessed."""

MOST_WORSE = 1.5
"""Ratio of the rms of images held out to that of fitted ones that is worth a remark."""


Images = Annotated[Sequence[Any], words(Path, "files of images", "IMAGE...", many=True)]
Squares = Annotated[tuple[int, int], words(whole_pair, "columns x rows, as 9x7", "COLUMNSxROWS")]


@verb()
def calibrate_camera(
    images: Images, /, *, squares: Squares, size: float,
    board: Annotated[str, one_of(BOARDS)] = BOARDS[0],
    model: Annotated[str, one_of(MODELS)] = MODELS[0],
    marker: float | None = None, markers: str | None = None, hold_out: float = HOLD_OUT,
    keep_outliers: Switch = False, name: str = "calibrated", rate: float = RATE,
    folder: OutFolder = None, overwrite: Switch = False, formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Fit:  # fmt: skip
    """Finds a camera's intrinsic parameters and its lens in images of a board.

    The images show one board in at least five ways: tilted against each other, and all over the
    image to its corners. A share of them is held out; the residuals of these are compared with
    those of the fitted ones. Images that fit far worse than the others are named and left out.

    Args:
        images: Images of the board, all of one size; in Python also arrays of 8 bits, grey or
            blue-green-red.
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
        folder: Results folder with camera.yaml, which robots take as the model of a camera mounting
            and scenarios as camera.model, results.json and a figure; default: runs/camera-NAME; in
            Python nothing is kept.
        overwrite: Replace results in the folder.
        formats: Formats of the figure.
        follow: Who follows the work.

    Raises:
        CameraCalibrationError: Images cannot be read, differ in size, or do not tell the camera.
        OutputFolderError: The folder holds other results or files, or cannot be written.
    """
    if not 0.0 < rate <= 1e5:
        raise CameraCalibrationError(
            f"rate: found {rate:g}; accepted: above 0 and at most 100000 [Hz]"
        )
    printed = CalibrationBoard(board, *squares, size, marker, markers)

    def work() -> Fit:
        views, empty, pixels = find_boards(images, printed, follow)
        follow.doing("Fitting the camera")
        fit = fit_camera(views, pixels, model, hold_out=hold_out, keep_outliers=keep_outliers)
        source = f"cdpr calibrate-camera, {len(views)} images of a {board} board"
        return _camera_fit(fit, _camera(fit, name, source, rate), empty)

    arguments = {
        "images": list(map(_identity, images)), "board": [board, *squares, size, marker, markers],
        "model": model, "hold_out": hold_out, "keep_outliers": keep_outliers, "name": name,
        "rate": rate,
    }  # fmt: skip
    return kept_fit(f"camera-{name}", arguments, work, folder, overwrite, formats, follow)


def find_boards(
    images: Sequence[Path | str | np.ndarray], board: CalibrationBoard, follow: Follow
) -> tuple[list[View], list[str], tuple[int, int]]:
    """The board in each image, names of images without it, and their width and height [px].

    Raises:
        CameraCalibrationError: An image cannot be read, or has another size than the first.
        StoppedError: It was stopped.
    """
    views: list[View] = []
    empty: list[str] = []
    size: tuple[int, int] | None = None
    for number, image in enumerate(images):
        name = f"image {number + 1}" if isinstance(image, np.ndarray) else Path(image).name
        follow.doing(f"Looking for boards, {number + 1} of {len(images)}")
        gray = _gray(image, name)
        pixels = (gray.shape[1], gray.shape[0])
        size = size or pixels
        if pixels != size:
            raise CameraCalibrationError(
                f"{name}: found {pixels[0]} x {pixels[1]} pixels; accepted: those of the first "
                f"image, {size[0]} x {size[1]}"
            )
        corners = board.find(gray)
        if corners is None:
            empty.append(name)
        else:
            views.append(View(name, *corners, board.together))
    if size is None:
        raise CameraCalibrationError("images: found none; accepted: files of images")
    return views, empty, size


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


def _identity(image: Path | str | np.ndarray) -> str:
    """What tells one image from another among the arguments of a results folder."""
    if isinstance(image, np.ndarray):
        return hashlib.sha256(np.ascontiguousarray(image).tobytes()).hexdigest()
    content = Path(image).read_bytes() if Path(image).is_file() else b""
    return f"{image} {hashlib.sha256(content).hexdigest()}"


def _camera(fit: CameraFit, name: str, source: str, rate: float) -> Camera:
    """The fitted camera, as its file has it."""
    pinhole, lens = fit.camera, fit.camera.distortion
    half = 0.5 * np.array([pinhole.width / pinhole.fx, pinhole.height / pinhole.fy])
    horizontal, vertical = np.degrees(2.0 * np.arctan(half)).tolist()
    distortion = None
    if lens is not None:
        coefficients = zip(COEFFICIENTS[lens.kind], lens.coefficients, strict=False)
        distortion = Distortion(kind=lens.kind, **dict(coefficients))
    return Camera(
        name=name, title="calibrated from images", source=source, width=pinhole.width,
        height=pinhole.height, view_angle_horizontal_deg=horizontal,
        view_angle_vertical_deg=vertical, rate_hz=rate,
        principal_point=np.array([pinhole.cx, pinhole.cy]), distortion=distortion,
    )  # fmt: skip


def _camera_fit(fit: CameraFit, camera: Camera, empty: Sequence[str]) -> Fit:
    """The fit of a camera, with its tables and its figure."""
    parameters = zip(fit.names, fit.values.tolist(), fit.deviations.tolist(), strict=True)
    unknowns = tuple(
        Unknown(name, "px" if k < 4 else "-", std, value=value)
        for k, (name, value, std) in enumerate(parameters)
    )
    remarks = _remarks(fit, empty)
    return Fit(
        title=f"Camera {camera.name}: lens {fit.model}", model=camera, model_file=CAMERA,
        status="converged", unknowns=unknowns, spread=None, remarks=tuple(remarks),
        held_out={"rms_px": finite(fit.rms("held out"))}, result=fit,
        details={
            "camera": camera.name, "model": fit.model, "width_px": fit.camera.width,
            "height_px": fit.camera.height, "fitted_rms_px": finite(fit.rms("fitted")),
            "held_out_rms_px": finite(fit.rms("held out")), "coverage": fit.coverage,
            "reach": fit.reach, "corners_left_out": fit.left_out, "tag_growth_px": fit.growth,
            "largest_tilt_deg": float(np.degrees(fit.tilt)),
            "images": [
                {"name": view.name, "role": view.role, "corners": len(view.uv),
                 "rms_px": finite(view.rms)}
                for view in fit.views
            ],
        },
        shown=(*_tables(fit, unknowns), *notes_table(remarks)),
        drawings={"camera": lambda: _figure(fit)},
    )  # fmt: skip


def _tables(fit: CameraFit, unknowns: Sequence[Unknown]) -> list[Table]:
    """Parameters, how images fit, what they show."""
    rows = []
    for role in ROLES:
        views = [view for view in fit.views if view.role == role]
        if views:
            rows.append((
                role, str(len(views)), str(sum(len(view.uv) for view in views)),
                f"{fit.rms(role):.3g}", f"{max(view.rms for view in views):.3g}",
            ))  # fmt: skip
    return [
        Table(
            f"Camera of {fit.camera.width} x {fit.camera.height} pixels, lens {fit.model}",
            ("parameter", "fitted", "standard deviation", "unit"),
            [(u.name, f"{u.value:.6g}", f"{u.std:.2g}", u.unit) for u in unknowns],
        ),
        Table(
            "Distance of corners from where they should be",
            ("images", "number", "corners", "rms [px]", "worst image [px]"), rows,
        ),
        Table("What the images show", ("what", "value"), [
            (f"cells of {CELLS[0]} x {CELLS[1]} with corners", f"{100 * fit.coverage:.0f} %"),
            ("farthest corner, of the half diagonal", f"{100 * fit.reach:.0f} %"),
            ("largest angle between boards", f"{np.degrees(fit.tilt):.0f} deg"),
        ]),
    ]  # fmt: skip


def _remarks(fit: CameraFit, empty: Sequence[str]) -> list[str]:
    """Sentences that a user should know."""
    fitted, held = fit.rms("fitted"), fit.rms("held out")

    def named(role: str, above: float) -> str:
        views = [view for view in fit.views if view.role == role and view.rms > above]
        return ", ".join(f"{view.name} ({view.rms:.2f} px)" for view in views)

    outliers, far = named("outlier", -1.0), named("held out", max(OUTLIER * fitted, LEAST_OUTLIER))
    fold = "".join(str(found) for _, found, _ in fold_refusals(fit.camera, ""))
    remarks = {
        "no board was found in " + ", ".join(empty): empty,
        f"left out, since they fit far worse than the others: {outliers}": outliers,
        f"{fit.left_out} corners were left out, since they are off by more than "
        f"{CORNER_OUTLIER:g} standard deviations of all": fit.left_out,
        f"corners of tags were seen {abs(fit.growth):.2f} px too far "
        f"{'in' if fit.growth < 0.0 else 'out'}, which is taken out": fit.growth,
        f"held out, and far worse than fitted images: {far}": far,
        f"corners lie in {100.0 * fit.coverage:.0f} % of the image's {CELLS[0]} x {CELLS[1]} "
        "cells: elsewhere the lens is guessed": fit.coverage < LEAST_COVERAGE,
        f"the farthest corner is at {100.0 * fit.reach:.0f} % of the way to a corner of the "
        "image: beyond, the lens is guessed": fit.reach < LEAST_REACH,
        f"images held out have {held / fitted:.1f} times the residuals of fitted ones: the lens "
        "has more freedom than these images tell": held > MOST_WORSE * fitted,
        fold: fold,
    }
    return [sentence for sentence, holds in remarks.items() if holds]


def _figure(fit: CameraFit) -> Figure:
    """Where corners lie and what the lens moves; residuals; rms of each image."""
    from cdpr_drake.analyses.frame.figures import bar_style, new_figure
    from cdpr_drake.palette import nth_look

    figure, (corners, residuals, images) = new_figure(1, 3, (17.0, 5.2), "Calibration of a camera")
    for k, (role, mark) in enumerate(ROLES.items()):
        views = [view for view in fit.views if view.role == role]
        finite_views = [view for view in views if np.isfinite(view.rms)]
        if finite_views:
            uv = np.concatenate([view.uv for view in finite_views])
            off = np.concatenate([view.residuals for view in finite_views])
            look = {"color": nth_look(k).color, "marker": mark, "linestyle": "", "ms": 4}
            corners.plot(*uv.T, label=role, **look)
            residuals.plot(*off.T, label=f"{role}, rms {fit.rms(role):.2g} px", **look)
        if views:
            places = [place for place, view in enumerate(fit.views) if view.role == role]
            images.bar(places, [view.rms for view in views], label=role, **bar_style(nth_look(k)))
    camera = fit.camera
    if camera.distortion is not None:
        v, u = np.mgrid[0 : camera.height : 7j, 0 : camera.width : 9j]
        ideal = np.vstack([u.ravel(), v.ravel()])
        corners.quiver(
            *ideal, *(camera.found_at(ideal) - ideal), angles="xy", scale_units="xy", scale=1.0,
            width=0.003, color="#202020", label="what the lens moves, to scale",
        )  # fmt: skip
    corners.set(
        xlim=(0, camera.width), ylim=(camera.height, 0), aspect="equal", xlabel="u [px]",
        ylabel="v [px]", title=f"corners: {100 * fit.coverage:.0f} % of the cells",
    )  # fmt: skip
    most = 1.05 * max(
        float(np.max(np.abs(view.residuals))) for view in fit.views
        if view.role != "outlier" and np.isfinite(view.rms)
    )  # fmt: skip
    residuals.set(
        xlim=(-most, most), ylim=(-most, most), aspect="equal", xlabel="residual along u [px]",
        ylabel="residual along v [px]", title="residuals",
    )  # fmt: skip
    images.set(xlabel="image, in the order given", ylabel="rms [px]", title="images")
    for axes in (corners, residuals, images):
        axes.legend(loc="best", fontsize=8)
    return figure
