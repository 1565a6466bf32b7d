"""What a robot file says of shapes, held against its box and its folder."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import Problems, RobotFileError
from cdpr_drake.models.hardware.shapes import MESH, FrameBeam, PlatformShape, mesh_path

FITS = 1e-6
"""Share of its longest edge by which a shape may reach out of the platform's box: rounding."""


def check_shapes(
    path: Path,
    shape: PlatformShape | None,
    beams: list[FrameBeam],
    *,
    box: tuple[Array, Array],
    mass: float | None,
) -> None:
    """Checks shapes, and makes the file of a mesh a path of its own.

    Args:
        path: The robot file.
        shape: The platform's shape; None: its box.
        beams: The frame's own beams.
        box: Middle of the platform's box in P and its edges, shape (3,) each [m].
        mass: The platform's [kg], where its inertia shall be that of the shape; None: it shall not.

    Raises:
        RobotFileError: Something is missing, not there, or reaches out of the platform's box.
    """
    problems = Problems(RobotFileError)

    def fail(field: str, found: object, accepted: str) -> None:
        problems.add(f"{path}: {field}: found {found}; accepted: {accepted}")

    for index, beam in enumerate(beams):
        if not beam.length() > 0.0:
            fail(f"frame.beams[{index}]", "both ends in one point", "ends apart")
    if shape is None:
        if mass is not None:
            fail("platform.inertia_of", "shape", "box, or a section platform.shape")
        problems.raise_any()
        return
    missing = shape.missing()
    if missing:
        fail(f"platform.shape.{missing}", "null", f"a value, for the kind {shape.kind}")
        problems.raise_any()
    if shape.kind == MESH:
        file = mesh_path(str(shape.file), path.parent)
        if file is None:
            accepted = f"an .obj or .gltf file, from {path.parent}"
            fail("platform.shape.file", shape.file, accepted)
            problems.raise_any()
        shape.file = str(file)
    lowest, highest = box[0] - box[1] / 2.0, box[0] + box[1] / 2.0
    slack = FITS * float(np.max(box[1]))
    with problems.collected():
        lower, upper = shape.extent(box[0])
        if np.any(lower < lowest - slack) or np.any(upper > highest + slack):
            fail(
                "platform.shape",
                f"reaching from {_words(lower)} to {_words(upper)} m",
                f"within the platform's box, {_words(lowest)} to {_words(highest)} m, with which "
                "pulleys and clearances reckon",
            )
        if mass is not None:
            shape.inertia(mass, box[0])
    problems.raise_any()


def _words(values: Array) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in values) + ")"
