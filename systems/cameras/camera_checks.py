"""Checks of a camera's settings that need more than one field."""

from __future__ import annotations

from pathlib import Path

from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.cameras.settings import PROJECTED, REGION, RENDERED, CameraSettings


def check_camera(camera: CameraSettings, path: Path) -> None:
    """Refuses what a camera of its kind cannot do.

    Args:
        camera: The settings.
        path: Of the scenario's file, for the message.

    Raises:
        ScenarioError: A projected camera shall look at a region, or a rendered one zoom.
    """
    if camera.region == REGION and camera.kind != RENDERED:
        raise ScenarioError(
            f"{path}: camera.region: found {REGION} with camera.kind {camera.kind}, which draws no "
            f"image; accepted: whole, or camera.kind {RENDERED}"
        )
    if camera.focus_zoom > 0.0 and camera.kind != PROJECTED:
        raise ScenarioError(
            f"{path}: camera.focus_zoom: found {camera.focus_zoom:g} with camera.kind "
            f"{camera.kind}, whose focal length does not change; accepted: 0, or camera.kind "
            f"{PROJECTED}"
        )
