"""A Drake camera, rendered by VTK, from a mounting of a robot."""

from __future__ import annotations

from ctypes import CDLL

from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    FrameId,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.systems.sensors import CameraInfo, RgbdSensor

from cdpr_drake.errors import RenderingError
from cdpr_drake.vision import Pinhole

RENDERER = "cdpr_vtk"

NEAR = 0.03
"""What is nearer to the camera [m] is not drawn: the platform's own bottom face, for one."""

FAR = 20.0


def check_rendering() -> None:
    """Makes sure that EGL is installed, which VTK draws with when there is no screen.

    Raises:
        RenderingError: A library is missing; names the package that brings it.
    """
    for library, package in (("libEGL.so.1", "libegl1"), ("libGL.so.1", "libgl1")):
        try:
            CDLL(library)
        except OSError as problem:
            raise RenderingError(
                f"the rendered camera needs {library}, found none; install the package "
                f"{package} (Debian, Ubuntu) and libgl1-mesa-dri, or use --camera projected"
            ) from problem


def add_renderer(scene_graph: SceneGraph) -> None:
    """Gives the scene a VTK renderer on EGL, named `RENDERER`, unless it has one.

    Raises:
        RenderingError: EGL is not installed.
    """
    check_rendering()
    if not scene_graph.HasRenderer(RENDERER):
        params = RenderEngineVtkParams(backend="EGL", default_clear_color=[0.75, 0.77, 0.80])
        scene_graph.AddRenderer(RENDERER, MakeRenderEngineVtk(params))


def make_rgbd_sensor(parent: FrameId, X_BC: RigidTransform, pinhole: Pinhole) -> RgbdSensor:
    """An RgbdSensor with the pinhole's intrinsic parameters.

    Args:
        parent: Geometry frame of the body B that carries the camera.
        X_BC: Pose of the camera frame C in B, z forward, y down [m].
        pinhole: Intrinsic parameters [px].
    """
    # Drake counts the principal point from the image's corner, `Pinhole` from the first pixel's
    # middle; a test compares a rendered tag with its projection.
    info = CameraInfo(
        width=pinhole.width,
        height=pinhole.height,
        focal_x=pinhole.fx,
        focal_y=pinhole.fy,
        center_x=pinhole.cx + 0.5,
        center_y=pinhole.cy + 0.5,
    )
    core = RenderCameraCore(RENDERER, info, ClippingRange(NEAR, FAR), RigidTransform())
    color = ColorRenderCamera(core, show_window=False)
    depth = DepthRenderCamera(core, DepthRange(NEAR, FAR))
    return RgbdSensor(parent_id=parent, X_PB=X_BC, color_camera=color, depth_camera=depth)
