"""The catalogue of cameras: what manufacturers publish, the pinhole model that follows, faults.

Files of your own, as `cdpr calibrate-camera` writes them, have the same fields, with what was
calibrated; `camera_info` files of ROS and files of OpenCV's FileStorage are read too.
"""

from collections.abc import Iterator
from dataclasses import fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated

import numpy as np

from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.camera_calibrations import read_calibration
from cdpr_drake.models.camera_files import CAMERA_FOLDER, CAMERA_SUFFIXES, camera_names
from cdpr_drake.schema.declarations import In, OneOf, Refusal, Scope, Text, settings, values
from cdpr_drake.schema.typed_yaml import closest, load_typed, refuse
from cdpr_drake.vision.lens_distortion import COEFFICIENTS, FARTHEST, NO_LENS, LensDistortion
from cdpr_drake.vision.pinhole import Pinhole


@settings
class Distortion:
    """What a lens does to the image of a pinhole, in the model and with the signs of OpenCV."""

    kind: Annotated[
        str,
        OneOf((NO_LENS, *COEFFICIENTS)),
        "none; brown_conrady, radial with k1 to k6, k4 to k6 in a denominator, and "
        "tangential with p1 and p2; fisheye, a polynomial of the angle from the axis with"
        " k1 to k4.",
    ] = NO_LENS
    k1: Annotated[float, In("-"), "First radial coefficient."] = 0.0
    k2: Annotated[float, In("-"), "Second radial coefficient."] = 0.0
    p1: Annotated[float, In("-"), "First tangential coefficient."] = 0.0
    p2: Annotated[float, In("-"), "Second tangential coefficient."] = 0.0
    k3: Annotated[float, In("-"), "Third radial coefficient."] = 0.0
    k4: Annotated[float, In("-"), "Fourth radial coefficient."] = 0.0
    k5: Annotated[float, In("-"), "Fifth radial coefficient."] = 0.0
    k6: Annotated[float, In("-"), "Sixth radial coefficient."] = 0.0

    def lens(self) -> LensDistortion | None:
        """The lens; None where it does nothing."""
        if self.kind == NO_LENS:
            return None
        names = COEFFICIENTS[self.kind]
        return LensDistortion(self.kind, tuple(float(getattr(self, name)) for name in names))

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Coefficients that its kind does not have."""
        known = COEFFICIENTS.get(self.kind, ())
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name != "kind" and field.name not in known and value != 0.0:
                has = f"0, or {', '.join(known)}" if known else "0, or another kind"
                yield field.name, f"{value:g} with kind {self.kind}", has


def fold_refusals(pinhole: Pinhole, key: str) -> Iterator[Refusal]:
    """A lens whose image folds over, or that sees more than this package computes with, within the
    picture; `key` is that of the lens."""
    share = pinhole.blind_share()
    if share == 0.0:
        return
    assert pinhole.distortion is not None
    angle = float(np.degrees(np.arctan(pinhole.distortion.valid_radius)))
    lens, size = f"a {pinhole.distortion.kind} lens", f"{pinhole.width} x {pinhole.height} pixels"
    if pinhole.distortion.valid_radius == FARTHEST:
        found = (
            f"{lens} that sees more than {angle:.1f} deg from the axis at {100.0 * share:.0f} % of "
            f"the rim of its {size}, beyond what this package computes with"
        )
        yield key, found, "less than a half space, as of an image that was cropped"
    else:
        found = (
            f"{lens} whose image folds over {angle:.1f} deg from the axis, within the image of "
            f"{size}, of whose rim it leaves {100.0 * share:.0f} % without a direction"
        )
        yield key, found, "coefficients that hold up to the corners"


@settings
class Camera:
    """A camera with its lens."""

    name: Annotated[Text, "Name, the same as that of its file."]
    title: Annotated[Text, "Maker and type of camera and lens."]
    source: Annotated[Text, "Where the values stand."]
    width: Annotated[int, In("px", ge=16), "Width of the full image."]
    height: Annotated[int, In("px", ge=16), "Height of the full image."]
    view_angle_horizontal_deg: Annotated[
        float, In("deg", gt=0.0, lt=180.0), "Full view angle along the width."
    ]
    view_angle_vertical_deg: Annotated[
        float, In("deg", gt=0.0, lt=180.0), "Full view angle along the height."
    ]
    rate_hz: Annotated[float, In("Hz", gt=0.0), "Largest frame rate."]
    assumptions: Annotated[Text, "Assumed values, and the reason for each."] = ""
    principal_point: Annotated[
        np.ndarray | None,
        In("px", 2),
        "Principal point (u, v) in the full image, from the middle of its upper left "
        "pixel; null: the middle of the image.",
    ] = None
    distortion: Annotated[
        Distortion | None,
        "What the lens does to the image of the pinhole that the view angles mean; null: nothing.",
    ] = None

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """A principal point outside of the image, and lenses that fold it over."""
        if self.principal_point is not None:
            u, v = self.principal_point
            if not (-0.5 < u < self.width - 0.5 and -0.5 < v < self.height - 0.5):
                accepted = f"a point in the image of {self.width} x {self.height} pixels"
                yield "principal_point", f"[{u:g}, {v:g}]", accepted
                return
        if self.distortion is None or not any(self.distortion.refusals(scope)):
            yield from fold_refusals(self.pinhole(self.width, self.height), "distortion")

    def pinhole(self, width: int, height: int) -> Pinhole:
        """The pinhole camera with these view angles and an image of width x height [px].

        The published angles hold exactly, even where they mean pixels that are not square. They are
        those of the pinhole: what a lens that distorts sees is more, or less.
        """
        pinhole = Pinhole.from_view_angles(
            width,
            height,
            float(np.radians(self.view_angle_horizontal_deg)),
            float(np.radians(self.view_angle_vertical_deg)),
        )
        if self.principal_point is not None:
            u, v = self.principal_point
            # The image's corner is half a pixel off the first pixel's middle, at every scale.
            pinhole = replace(
                pinhole,
                cx=float((u + 0.5) * width / self.width - 0.5),
                cy=float((v + 0.5) * height / self.height - 0.5),
            )
        lens = None if self.distortion is None else self.distortion.lens()
        return pinhole if lens is None else replace(pinhole, distortion=lens)

    def view_slopes(self) -> tuple[float, float]:
        """Tangents of half the angles along x and y of C of a view that is seen in full [-].

        With a lens, or with a principal point off the middle, see `Pinhole.view_slopes`.
        """
        if self.principal_point is not None or self.distortion is not None:
            return self.pinhole(self.width, self.height).view_slopes()
        angles = self.view_angle_horizontal_deg, self.view_angle_vertical_deg
        x, y = (float(np.tan(0.5 * np.radians(angle))) for angle in angles)
        return x, y


DEAD, FROZEN, OFF = "dead", "frozen", "off"


@settings
class CameraFault:
    """A span of time in which a projected camera fails."""

    kind: Annotated[
        str,
        OneOf((DEAD, FROZEN, OFF)),
        "dead: finds nothing, as one that is covered or unplugged; frozen: gives its last"
        " image again and again; off: takes for the target what is beside it, or was "
        "itself knocked.",
    ] = DEAD
    start: Annotated[float, In("s", ge=0.0), "When it begins."] = 0.0
    duration: Annotated[float, In("s", gt=0.0), "How long it lasts."]
    offset: Annotated[
        np.ndarray,
        In("m", 3),
        "What is taken for the target, from its origin in the camera frame; kind off only.",
    ] = values(0.03, 0.0, 0.0)
    angles_deg: Annotated[
        np.ndarray,
        In("deg", 3),
        "Angles of R = Rx Ry Rz by which the camera's frame is turned from the one it is "
        "believed to have, as of a camera that was knocked; kind off only.",
    ] = values(0.0, 0.0, 0.0)

    def holds(self, time: float) -> bool:
        """Whether it fails at a time [s]."""
        return self.start - 1e-9 <= time < self.start + self.duration - 1e-9


def load_camera(name: str) -> Camera:
    """A camera of the catalogue by its name, or of a file by its path.

    Raises:
        RobotFileError: There is no such camera, and says which exist; or the file describes none.
    """
    if name.lower().endswith(CAMERA_SUFFIXES):
        return load_camera_file(Path(name))
    return _of_catalogue(name)


def load_camera_file(path: Path) -> Camera:
    """Reads a camera's file.

    Raises:
        RobotFileError: It cannot be read, or its lens folds its image over or sees too much.
    """
    calibration = None if path.parent == CAMERA_FOLDER else read_calibration(path)
    if calibration is None:
        camera = load_typed(
            Camera, path, error=RobotFileError, scope=lambda camera: Scope(camera, path)
        )
    else:
        lens = calibration.pop("distortion")
        camera = Camera(**calibration, distortion=None if lens is None else Distortion(**lens))
        refuse(camera, "", path=path, error=RobotFileError)
    return camera


@lru_cache
def _of_catalogue(name: str) -> Camera:
    if name not in camera_names():
        raise RobotFileError(f"camera {name!r} is unknown; {closest(name, camera_names())}")
    return load_camera_file(CAMERA_FOLDER / f"{name}.yaml")
