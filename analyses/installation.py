"""The installation on this machine: whether it has what is needed, and kernels compiled beforehand.

`examine` looks for what cdpr_drake needs, and says the remedy where something is missing or does
not work. `compilation_steps` and `compile_step` compile at once what the first simulation, the
first tension query and others would wait for.
"""

from __future__ import annotations

import gc
import importlib
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, version

from cdpr_drake.errors import CdprError
from cdpr_drake.kernel_cache.background import compile_needed
from cdpr_drake.kernel_cache.kernel_list import group_names
from cdpr_drake.models.rendered_camera import check_rendering

RENDER_TIMEOUT = 120.0
"""A first image takes about a second; a machine that needs longer than this [s] is of no use."""


@dataclass(frozen=True)
class Finding:
    """One check: what, whether it passed, what was found, and what to do if not."""

    check: str
    passed: bool
    found: str
    remedy: str = ""


_RENDER_PROGRAM = """
from cdpr_drake.analyses.installation import render_and_detect
print(render_and_detect())
"""


def render_and_detect() -> str:
    """Renders the default scenario's first image and finds the tag in it; says how that went."""
    from cdpr_drake.systems.diagrams.load import load_scenario
    from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo

    servo = build_visual_servo(load_scenario("acrobot_pbvs"))
    context = servo.make_context()
    sensor = servo.diagram.GetSubsystemByName("camera")
    detector = servo.diagram.GetSubsystemByName("detector")
    image = sensor.GetOutputPort("color_image").Eval(sensor.GetMyContextFromRoot(context))
    marks = detector.find_marks(detector.GetMyContextFromRoot(context))
    seen = "tag found" if marks is not None else "tag NOT found"
    return f"{image.width()} x {image.height()} image, {seen}"


def _python() -> Finding:
    found = ".".join(str(part) for part in sys.version_info[:3])
    return Finding("Python", sys.version_info >= (3, 11), found, "install Python 3.11 or newer")


def _package(name: str, module: str) -> Finding:
    remedy = f"pip install --upgrade {name}"
    try:
        importlib.import_module(module)
        return Finding(name, True, version(name))
    except (ImportError, PackageNotFoundError) as problem:
        return Finding(name, False, str(problem), remedy)


def _extra(name: str, extra: str, serves: str) -> Finding:
    """A package that one part needs and the rest does without: it is no fault that it is absent."""
    try:
        return Finding(name, True, version(name))
    except PackageNotFoundError:
        return Finding(name, True, f"absent; {serves} need it: pip install 'cdpr_drake[{extra}]'")


def _aruco() -> Finding:
    import cv2

    found = hasattr(cv2, "aruco") and hasattr(cv2.aruco, "ArucoDetector")
    remedy = "pip install --upgrade 'opencv-python-headless>=4.8', and remove other OpenCV packages"
    return Finding("OpenCV AprilTag detector", found, "present" if found else "missing", remedy)


def _egl() -> Finding:
    try:
        check_rendering()
    except CdprError as problem:
        return Finding("EGL", False, str(problem), "apt-get install libegl1 libgl1 libgl1-mesa-dri")
    return Finding("EGL", True, "libEGL loads")


def _rendering() -> Finding:
    """In a process of its own, since a broken graphics driver ends the process."""
    remedy = (
        "apt-get install libegl1 libgl1 libgl1-mesa-dri, or use cdpr simulate --camera projected"
    )
    try:
        done = subprocess.run(
            [sys.executable, "-c", _RENDER_PROGRAM],
            capture_output=True,
            text=True,
            timeout=RENDER_TIMEOUT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return Finding("rendered camera", False, f"nothing after {RENDER_TIMEOUT:g} s", remedy)
    lines = (done.stdout if done.returncode == 0 else done.stderr).strip().splitlines()
    said = lines[-1] if lines else f"ended with code {done.returncode}"
    passed = done.returncode == 0 and said.endswith("tag found")
    return Finding("rendered camera", passed, said, remedy)


CHECKS: tuple[Callable[[], Finding], ...] = (
    _python,
    lambda: _package("drake", "pydrake"),
    lambda: _package("numpy", "numpy"),
    lambda: _package("scipy", "scipy"),
    lambda: _package("numba", "numba"),
    lambda: _package("opencv-python-headless", "cv2"),
    lambda: _package("matplotlib", "matplotlib"),
    lambda: _extra("gymnasium", "gym", "learning environments"),
    _aruco,
    _egl,
    _rendering,
)


def examine() -> list[Finding]:
    """All checks; where one fails the rest still run."""
    return [
        Finding(f.check, f.passed, f.found, "" if f.passed else f.remedy)
        for f in (check() for check in CHECKS)
    ]


LISTED = "the default simulation, as listed"
"""A step that begins at the other end."""

PIECE = 0.05
"""Simulated time of a scenario [s]: at least one image and one control step of each."""


def compilation_steps() -> list[tuple[str, Callable[[], None]]]:
    """What to call, one after the other, and what each compiles: a name for progress.

    Every scenario that ships is simulated for a moment, the default one by both engines; and every
    method distributes tensions once. What is compiled already, or by an earlier step, is not again.
    """
    from cdpr_drake.systems.scenarios.files import (
        MECHANISM,
        PICK_AND_PLACE,
        TENSION_CONTROL,
        VISUAL_SERVO,
        scenario_names,
    )

    servos = sorted(scenario_names(VISUAL_SERVO), key=lambda name: name != "acrobot_pbvs")
    projected, compiled = "camera.kind=projected", "integration.engine=compiled"
    steps: list[tuple[str, Callable[[], None]]] = [("tension methods", _distribute)]
    for name in servos:
        steps.append((name, partial(_simulate, name, (projected,))))
        if name == "acrobot_pbvs":
            more = (projected, compiled)
            steps.append((f"{name}, compiled engine", partial(_simulate, name, more)))
    for kind in (TENSION_CONTROL, MECHANISM):
        steps += [(name, partial(_simulate, name, ())) for name in scenario_names(kind)]
    steps += [
        (name, partial(_simulate, name, (projected,))) for name in scenario_names(PICK_AND_PLACE)
    ]
    return steps


def compile_step(name: str) -> None:
    """Does the step of a name; several processes may do different ones, and share the work.

    The first of all, `LISTED`, compiles what the default simulation needs from the last kernel to
    the first, where other steps come last.
    """
    paused = gc.isenabled()
    gc.disable()  # the compiler makes many objects and little garbage
    try:
        if name == LISTED:
            compile_needed(group_names())
        else:
            dict(compilation_steps())[name]()
    finally:
        if paused:
            gc.enable()


def _distribute() -> None:
    from cdpr_drake.analyses.tensions import ALL, solve_tensions

    solve_tensions("acrobot_large", method=ALL)


def _simulate(name: str, overrides: Sequence[str]) -> None:
    from cdpr_drake.analyses.simulation.scenario_kinds import SCENARIO_KINDS
    from cdpr_drake.systems.diagrams.load import load_scenario

    scenario = load_scenario(name, [*overrides, f"duration={PIECE}"])
    SCENARIO_KINDS[scenario.kind].run(scenario)
