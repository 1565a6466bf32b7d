"""A Drake camera, rendered by VTK, from a mounting of a robot."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import warnings
from ctypes import CDLL
from dataclasses import dataclass

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
from pydrake.systems.sensors import CameraInfo, ImageRgba8U, RgbdSensor

from cdpr_drake.errors import RenderingError
from cdpr_drake.models.scene import FLOOR_COLOR
from cdpr_drake.vision.pinhole import Pinhole

RENDERER = "cdpr_vtk"

NEAR = 0.03
"""What is nearer to the camera [m] is not drawn: the platform's own bottom face, for one."""

FAR = 20.0

BACKGROUND = FLOOR_COLOR[:3]
"""Of images, red, green and blue: they show no floor."""

_IN_PLACE = RigidTransform()

COPY_TIMEOUT = 5.0
"""A copy of the process that has not drawn an image by then hangs [s]."""

PROBE_TIMEOUT = 120.0
"""A machine that needs longer than this for its first image is of no use [s]."""

_PROBE_PROGRAM = "from cdpr_drake.models.rendered_camera import render_once; render_once()"


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
                f"{package} (Debian, Ubuntu) and libgl1-mesa-dri, or use camera.kind=projected"
            ) from problem


@dataclass
class _State:
    """What is known of rendering in this process."""

    works: bool = False
    has_renderer: bool = False


_state = _State()


def render_once() -> None:
    """Draws one small image of nothing as rendered cameras do; a broken driver ends the process."""
    core = RenderCameraCore(RENDERER, CameraInfo(8, 8, 1.0), ClippingRange(NEAR, FAR), _IN_PLACE)
    camera = ColorRenderCamera(core, show_window=False)
    MakeRenderEngineVtk(_parameters()).RenderColorImage(camera, ImageRgba8U(8, 8))


def probe_rendering() -> None:
    """Makes sure that rendering works, which a broken graphics driver answers by SIGSEGV.

    A copy of this process draws an image first; that takes a fifth of a second. A copy of a process
    that has drawn, or has threads, may hang or end though rendering works: only a new process, in
    its second and a half, proves that it does not. What a process has once found to work is not
    tried again in it; nothing is kept for others, whose drivers or environment may differ.

    Raises:
        RenderingError: EGL is missing, or what drew ended or hung; names the remedy.
    """
    check_rendering()
    if _state.works:
        return
    if sys.platform == "linux" and not _state.has_renderer and _copy_renders():
        _state.works = True
        return
    try:
        done = subprocess.run(
            [sys.executable, "-c", _PROBE_PROGRAM],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=PROBE_TIMEOUT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        how = f"gives no image within {PROBE_TIMEOUT:g} s"
    else:
        if done.returncode == 0:
            _state.works = True
            return
        how = f"ends a process with code {done.returncode}"
        if done.returncode < 0:
            how = f"ends a process by {signal.Signals(-done.returncode).name}"
    raise RenderingError(
        f"the rendered camera: drawing an image {how}, as broken graphics drivers do; install "
        "libgl1-mesa-dri (Debian, Ubuntu), look at `cdpr doctor`, or use camera.kind=projected"
    )


def _copy_renders() -> bool:
    """Whether a copy of this process draws an image and ends well."""
    with warnings.catch_warnings():
        # Newer versions of Python warn of threads; what they may do to the copy is known here.
        warnings.simplefilter("ignore", DeprecationWarning)
        pid = os.fork()
    if pid == 0:
        try:
            for number in (signal.SIGINT, signal.SIGTERM):
                signal.signal(number, signal.SIG_DFL)
            nowhere = os.open(os.devnull, os.O_WRONLY)
            for stream in (1, 2):
                os.dup2(nowhere, stream)
            render_once()
            os._exit(0)
        finally:
            os._exit(1)
    end = time.monotonic() + COPY_TIMEOUT
    while time.monotonic() < end:
        ended, status = os.waitpid(pid, os.WNOHANG)
        if ended == pid:
            return status == 0
        time.sleep(0.005)
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    return False


def _parameters() -> RenderEngineVtkParams:
    return RenderEngineVtkParams(backend="EGL", default_clear_color=list(BACKGROUND))


def add_renderer(scene_graph: SceneGraph) -> None:
    """Gives the scene a VTK renderer on EGL, named `RENDERER`, unless it has one.

    Raises:
        RenderingError: EGL is not installed.
    """
    check_rendering()
    if not scene_graph.HasRenderer(RENDERER):
        _state.has_renderer = True
        scene_graph.AddRenderer(RENDERER, MakeRenderEngineVtk(_parameters()))


def color_camera(pinhole: Pinhole) -> ColorRenderCamera:
    """What Drake draws colours by, with the pinhole's intrinsic parameters.

    Its principal point must lie inside the image: Drake refuses others.
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
    core = RenderCameraCore(RENDERER, info, ClippingRange(NEAR, FAR), _IN_PLACE)
    return ColorRenderCamera(core, show_window=False)


def make_depth_camera(
    parent: FrameId, X_BC: RigidTransform, pinhole: Pinhole, limits: tuple[float, float]
) -> RgbdSensor:
    """An RgbdSensor of which the depth is meant.

    Args:
        parent: Geometry frame of the body B that carries the camera.
        X_BC: Pose of the camera frame C in B, z forward, y down [m].
        pinhole: Intrinsic parameters [px].
        limits: Smallest and largest depth [m]; nearer is 0, farther inf.
    """
    low, high = limits
    info = color_camera(pinhole).core().intrinsics()
    # A little more is drawn than is reported, so that the limits are the sensor's.
    core = RenderCameraCore(RENDERER, info, ClippingRange(0.5 * low, 1.1 * high), _IN_PLACE)
    color = ColorRenderCamera(core, show_window=False)
    depth = DepthRenderCamera(core, DepthRange(low, high))
    return RgbdSensor(parent_id=parent, X_PB=X_BC, color_camera=color, depth_camera=depth)


def make_rgbd_sensor(parent: FrameId, X_BC: RigidTransform, pinhole: Pinhole) -> RgbdSensor:
    """An RgbdSensor with the pinhole's intrinsic parameters.

    Args:
        parent: Geometry frame of the body B that carries the camera.
        X_BC: Pose of the camera frame C in B, z forward, y down [m].
        pinhole: Intrinsic parameters [px].
    """
    color = color_camera(pinhole)
    # Depth is drawn only for who asks its port.
    depth = DepthRenderCamera(color.core(), DepthRange(NEAR, FAR))
    return RgbdSensor(parent_id=parent, X_PB=X_BC, color_camera=color, depth_camera=depth)
