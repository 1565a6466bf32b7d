"""The catalogue of cameras: what manufacturers publish, the pinhole model that follows, faults."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from cdpr_drake.errors import RobotFileError
from cdpr_drake.schema.fields import array, number, text, whole
from cdpr_drake.schema.typed_yaml import closest, load_typed
from cdpr_drake.vision.pinhole import Pinhole

_FOLDER = Path(__file__).parent / "cameras"


@dataclass(kw_only=True)
class Camera:
    """A camera with its lens."""

    name: str = text("Name, the same as that of its file.")
    title: str = text("Maker and type of camera and lens.")
    source: str = text("Where the values stand.")
    width: int = whole("Width of the full image.", unit="px", at_least=16)
    height: int = whole("Height of the full image.", unit="px", at_least=16)
    view_angle_horizontal_deg: float = number(
        "Full view angle along the width.", "deg", above=0.0, below=180.0
    )
    view_angle_vertical_deg: float = number(
        "Full view angle along the height.", "deg", above=0.0, below=180.0
    )
    rate_hz: float = number("Largest frame rate.", "Hz", above=0.0)
    assumptions: str = text("Values that no source gives, and what they were taken from.", "")

    def pinhole(self, width: int, height: int) -> Pinhole:
        """The pinhole camera with these view angles and an image of width x height [px].

        The published angles hold exactly, even where they mean pixels that are not square.
        """
        return Pinhole.from_view_angles(
            width,
            height,
            float(np.radians(self.view_angle_horizontal_deg)),
            float(np.radians(self.view_angle_vertical_deg)),
        )


DEAD, FROZEN, OFF = "dead", "frozen", "off"


@dataclass(kw_only=True)
class CameraFault:
    """A span of time in which a projected camera fails."""

    kind: str = text(
        "dead: finds nothing, as one that is covered or unplugged; frozen: gives its last image "
        "again and again; off: takes for the target what is beside it, or was itself knocked.",
        DEAD,
        choices=(DEAD, FROZEN, OFF),
    )
    start: float = number("When it begins.", "s", 0.0, at_least=0.0)
    duration: float = number("How long it lasts.", "s", above=0.0)
    offset: np.ndarray = array(
        "What is taken for the target, from its origin in the camera frame; kind off only.",
        "m",
        (3,),
        (0.03, 0.0, 0.0),
    )
    angles_deg: np.ndarray = array(
        "Angles of R = Rx Ry Rz by which the camera's frame is turned from the one it is believed "
        "to have, as of a camera that was knocked; kind off only.",
        "deg",
        (3,),
        (0.0, 0.0, 0.0),
    )

    def holds(self, time: float) -> bool:
        """Whether it fails at a time [s]."""
        return self.start - 1e-9 <= time < self.start + self.duration - 1e-9


def camera_names() -> tuple[str, ...]:
    """Names of the cameras of the catalogue."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("*.yaml")))


@lru_cache
def load_camera(name: str) -> Camera:
    """Reads a camera of the catalogue.

    Raises:
        RobotFileError: There is no such camera; says which exist.
    """
    if name not in camera_names():
        raise RobotFileError(f"camera {name!r} is unknown; {closest(name, camera_names())}")
    return load_typed(Camera, _FOLDER / f"{name}.yaml", error=RobotFileError)
