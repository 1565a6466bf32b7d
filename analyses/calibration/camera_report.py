"""What a calibration of a camera says: numbers, tables, a figure, the camera's file."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.frame.figures import bar_style, new_figure
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.analyses.reporting.tables import new_table
from cdpr_drake.models.camera_catalogue import Camera, Distortion, fold_problem
from cdpr_drake.palette import nth_look
from cdpr_drake.vision.camera_fit import CELLS, CORNER_OUTLIER, LEAST_OUTLIER, OUTLIER, CameraFit
from cdpr_drake.vision.lens_distortion import COEFFICIENTS

ROLES = ("fitted", "held out", "outlier")

LEAST_COVERAGE = 0.6
"""Share of an image's cells that corners should lie in."""

LEAST_REACH = 0.85
"""Of the way to a corner of the image, beyond which a lens is guessed."""

MOST_WORSE = 1.5
"""Times the fitted rms above which that of images held out is worth a remark."""

_MARKS = {"fitted": ".", "held out": "x", "outlier": "^"}


def fitted_camera(fit: CameraFit, name: str, source: str, rate: float) -> Camera:
    """The camera's file.

    Args:
        fit: What was fitted.
        name: Name of the camera.
        source: Where its values come from.
        rate: Images per second [Hz].
    """
    pinhole = fit.camera
    half = 0.5 * np.array([pinhole.width / pinhole.fx, pinhole.height / pinhole.fy])
    angles = np.degrees(2.0 * np.arctan(half))
    lens, section = pinhole.distortion, None
    if lens is not None:
        found = dict(zip(COEFFICIENTS[lens.kind], lens.coefficients, strict=False))
        section = Distortion(kind=lens.kind, **found)
    return Camera(
        name=name, title="calibrated from images", source=source,
        width=pinhole.width, height=pinhole.height,
        view_angle_horizontal_deg=float(angles[0]), view_angle_vertical_deg=float(angles[1]),
        rate_hz=rate, principal_point=np.array([pinhole.cx, pinhole.cy]), distortion=section,
    )  # fmt: skip


def camera_remarks(fit: CameraFit, unseen: list[str]) -> list[str]:
    """What should be known of a fit, a line each.

    Args:
        fit: The fit.
        unseen: Images in which the board was not found.
    """
    said = []
    if unseen:
        said.append("no board was found in " + ", ".join(unseen))
    bad = [f"{view.name} ({view.rms:.2f} px)" for view in fit.views if view.role == "outlier"]
    if bad:
        said.append("left out, since they fit far worse than the others: " + ", ".join(bad))
    if fit.left_out:
        said.append(
            f"{fit.left_out} corners were left out, since they are off by more than "
            f"{CORNER_OUTLIER:g} standard deviations of all"
        )
    if fit.growth:
        said.append(
            f"corners of tags were seen {abs(fit.growth):.2f} px too far "
            f"{'in' if fit.growth < 0.0 else 'out'}, which is taken out"
        )
    own = fit.rms("fitted")
    far = [
        f"{view.name} ({view.rms:.2f} px)"
        for view in fit.views
        if view.role == "held out" and view.rms > max(OUTLIER * own, LEAST_OUTLIER)
    ]
    if far:
        said.append("held out, and far worse than fitted images: " + ", ".join(far))
    if fit.coverage < LEAST_COVERAGE:
        said.append(
            f"corners lie in {100.0 * fit.coverage:.0f} % of the image's {CELLS[0]} x {CELLS[1]} "
            "cells: elsewhere the lens is guessed"
        )
    if fit.reach < LEAST_REACH:
        said.append(
            f"the farthest corner is at {100.0 * fit.reach:.0f} % of the way to a corner of the "
            "image: beyond, the lens is guessed"
        )
    held = fit.rms("held out")
    if held > MOST_WORSE * own:
        said.append(
            f"images held out have {held / own:.1f} times the residuals of fitted ones: the lens "
            "has more freedom than these images tell"
        )
    fold = fold_problem(fit.camera)
    if fold:
        said.append(fold)
    return said


def camera_numbers(fit: CameraFit, remarks: list[str], camera: Camera) -> dict[str, Any]:
    """Everything for JSON."""
    return {
        "camera": camera.name,
        "model": fit.model,
        "width_px": fit.camera.width,
        "height_px": fit.camera.height,
        "parameters": [
            {"name": name, "unit": "px" if k < 4 else "-", "value": float(value), "std": float(std)}
            for k, (name, value, std) in enumerate(
                zip(fit.names, fit.values, fit.deviations, strict=True)
            )
        ],
        "fitted_rms_px": finite(fit.rms("fitted")),
        "held_out_rms_px": finite(fit.rms("held out")),
        "coverage": fit.coverage,
        "reach": fit.reach,
        "corners_left_out": fit.left_out,
        "tag_growth_px": fit.growth,
        "largest_tilt_deg": float(np.degrees(fit.tilt)),
        "images": [
            {
                "name": view.name, "role": view.role, "corners": len(view.uv),
                "rms_px": finite(view.rms),
            }
            for view in fit.views
        ],
        "remarks": remarks,
        "versions": package_versions(),
    }  # fmt: skip


def camera_tables(fit: CameraFit, remarks: list[str]) -> list[Table]:
    """Parameters, how images fit, remarks."""
    parameters = new_table(
        f"Camera of {fit.camera.width} x {fit.camera.height} pixels, lens {fit.model}",
        ("parameter",), ("fitted", "standard deviation", "unit"),
    )  # fmt: skip
    for k, (name, value, std) in enumerate(zip(fit.names, fit.values, fit.deviations, strict=True)):
        unit = "px" if k < 4 else "-"
        parameters.add_row(name, f"{value:.6g}", f"{std:.2g}", unit)
    images = new_table("Distance of corners from where they should be", ("images",), (
        "number", "corners", "rms [px]", "worst image [px]",
    ))  # fmt: skip
    for role in ROLES:
        mine = [view for view in fit.views if view.role == role]
        if mine:
            images.add_row(
                role, str(len(mine)), str(sum(len(view.uv) for view in mine)),
                f"{fit.rms(role):.3g}", f"{max(view.rms for view in mine):.3g}",
            )  # fmt: skip
    seen = new_table("What the images show", ("what",), ("found",))
    seen.add_row(f"cells of {CELLS[0]} x {CELLS[1]} with corners", f"{100 * fit.coverage:.0f} %")
    seen.add_row("farthest corner, of the half diagonal", f"{100 * fit.reach:.0f} %")
    seen.add_row("largest angle between boards", f"{np.degrees(fit.tilt):.0f} deg")
    tables = [parameters, images, seen]
    if remarks:
        notes = new_table("To know", ("remark",), ())
        for words in remarks:
            notes.add_row(words)
        tables.append(notes)
    return tables


def camera_figure(fit: CameraFit) -> Figure:
    """Where corners lie and what the lens moves; residuals; rms of each image."""
    figure, axes = new_figure(1, 3, (17.0, 5.2), "Calibration of a camera")
    for k, role in enumerate(ROLES):
        mine = [view for view in fit.views if view.role == role and np.isfinite(view.rms)]
        if not mine:
            continue
        uv = np.concatenate([view.uv for view in mine])
        off = np.concatenate([view.residuals for view in mine])
        look = {"color": nth_look(k).color, "marker": _MARKS[role], "linestyle": "", "ms": 4}
        axes[0].plot(uv[:, 0], uv[:, 1], label=role, **look)
        axes[1].plot(off[:, 0], off[:, 1], label=f"{role}, rms {fit.rms(role):.2g} px", **look)
    camera = fit.camera
    if camera.distortion is not None:
        v, u = np.mgrid[0 : camera.height : 7j, 0 : camera.width : 9j]
        ideal = np.vstack([u.ravel(), v.ravel()])
        moved = camera.found_at(ideal)
        axes[0].quiver(
            *ideal, *(moved - ideal), angles="xy", scale_units="xy", scale=1.0, width=0.003,
            color="#202020", label="what the lens moves, to scale",
        )  # fmt: skip
    axes[0].set(
        xlim=(0, camera.width), ylim=(camera.height, 0), aspect="equal", xlabel="u [px]",
        ylabel="v [px]", title=f"corners: {100 * fit.coverage:.0f} % of the cells",
    )  # fmt: skip
    most = 1.05 * max(
        float(np.max(np.abs(view.residuals))) for view in fit.views if view.role != "outlier"
    )
    axes[1].set(
        xlim=(-most, most), ylim=(-most, most), aspect="equal", xlabel="residual along u [px]",
        ylabel="residual along v [px]", title="residuals",
    )  # fmt: skip
    for k, role in enumerate(ROLES):
        own = [(n, view.rms) for n, view in enumerate(fit.views) if view.role == role]
        if own:
            places, heights = zip(*own, strict=True)
            axes[2].bar(places, heights, label=role, **bar_style(nth_look(k)))
    axes[2].set(xlabel="image, in the order given", ylabel="rms [px]", title="images")
    for axis in axes:
        axis.legend(loc="best", fontsize=8)
    return figure
