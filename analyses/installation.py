"""The installation on this machine: what it has and lacks, and kernels compiled beforehand."""

from __future__ import annotations

import gc
import importlib
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from typing import Annotated, Any

from cyclopts import Parameter

from cdpr_drake.analyses.frame.follow import NOBODY, Count, Follow
from cdpr_drake.analyses.frame.jobs import default_workers, finished_jobs
from cdpr_drake.analyses.frame.result import Listing, Result, Table
from cdpr_drake.analyses.reporting.provenance import browser
from cdpr_drake.errors import CdprError, StoppedError, install_words
from cdpr_drake.kernel_cache.background import compile_needed
from cdpr_drake.kernel_cache.kernel_list import group_names, missing_kernels, needed_kernels
from cdpr_drake.models.rendered_camera import check_rendering

RENDER_TIMEOUT = 120.0
"""A first image takes about a second; a machine that needs longer than this [s] is of no use."""


@dataclass(frozen=True)
class Finding:
    """One check: its name, whether it passed, its result in words, and what to do if not."""

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
    words = "tag found" if marks is not None else "tag NOT found"
    return f"{image.width()} x {image.height()} image, {words}"


GRAPHICS = "apt-get install libegl1 libgl1 libgl1-mesa-dri"

PACKAGES = {
    "drake": "pydrake", "numpy": "numpy", "scipy": "scipy", "numba": "numba",
    "opencv-python-headless": "cv2", "matplotlib": "matplotlib",
}  # fmt: skip
"""Modules of the packages that everything needs."""

EXTRAS = {
    "gymnasium": ("gym", "learning environments"), "nicegui": ("studio", "cdpr studio"),
    "pyzmq": ("bridge", "cdpr serve"), "distributed": ("cluster", "Dask clusters"),
    "cmaes": ("design", "cdpr design"), "pyarrow": ("parquet", "logs as parquet"),
    "mcap": ("mcap", "logs of MCAP"), "rosbags": ("ros", "bags of ROS"),
    "trimesh": ("mesh", "meshes of obstacles"), "mujoco": ("mjcf", "files of MuJoCo"),
}  # fmt: skip
"""Packages that one part needs and the rest does without: their extra, and that part."""


def _python() -> Finding:
    release = ".".join(str(part) for part in sys.version_info[:3])
    return Finding("Python", sys.version_info >= (3, 11), release, "install Python 3.11 or newer")


def _package(name: str, module: str) -> Finding:
    try:
        importlib.import_module(module)
        return Finding(name, True, version(name))
    except (ImportError, PackageNotFoundError) as problem:
        return Finding(name, False, str(problem), f"pip install --upgrade {name}")


def _extra(name: str, extra: str, serves: str) -> Finding:
    """It is no fault that it is absent."""
    try:
        return Finding(name, True, version(name))
    except PackageNotFoundError:
        remedy = install_words(extra)
        return Finding(name, True, f"absent; for {serves}: {remedy}")


def _aruco() -> Finding:
    import cv2

    present = hasattr(cv2, "aruco") and hasattr(cv2.aruco, "ArucoDetector")
    remedy = "pip install --upgrade 'opencv-python-headless>=4.8', and remove other OpenCV packages"
    words = "present" if present else "missing"
    return Finding("OpenCV AprilTag detector", present, words, remedy)


def _egl() -> Finding:
    try:
        check_rendering()
    except CdprError as problem:
        return Finding("EGL", False, str(problem), GRAPHICS)
    return Finding("EGL", True, "libEGL loads")


def _rendering() -> Finding:
    """In a process of its own, since a broken graphics driver ends the process."""
    check, remedy = "rendered camera", f"{GRAPHICS}, or use cdpr simulate --camera projected"
    try:
        done = subprocess.run(
            [sys.executable, "-c", _RENDER_PROGRAM], capture_output=True, text=True,
            timeout=RENDER_TIMEOUT, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return Finding(check, False, f"nothing after {RENDER_TIMEOUT:g} s", remedy)
    lines = (done.stdout if done.returncode == 0 else done.stderr).strip().splitlines()
    words = lines[-1] if lines else f"ended with code {done.returncode}"
    return Finding(check, done.returncode == 0 and words.endswith("tag found"), words, remedy)


def _kernels() -> Finding:
    missing, needed = missing_kernels(group_names()), len(needed_kernels(group_names()))
    words = f"{needed - missing} of {needed} are compiled"
    if missing:
        words += "; the others are at their first use, or by cdpr doctor --compile"
    return Finding("compiled kernels", True, words)


def _browser() -> Finding:
    absent = "absent; for cdpr reproduce --pdf: install chromium"
    return Finding("browser", True, browser() or absent)


CHECKS: tuple[Callable[[], Finding], ...] = (
    _python,
    *(partial(_package, *words) for words in PACKAGES.items()),
    _aruco, _egl, _rendering, _kernels, _browser,
    *(partial(_extra, name, *words) for name, words in EXTRAS.items()),
)  # fmt: skip


@dataclass(frozen=True, repr=False)
class Compilation(Result):
    """Kernels that were compiled for later.

    Attributes:
        steps: What was done.
        seconds: How long that took [s].
    """

    steps: Sequence[str]
    seconds: float

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"steps": list(self.steps), "wall_time_s": self.seconds}

    def notes(self) -> list[str]:
        """How long it took."""
        return [f"Kernels are compiled and kept; that took {self.seconds:.0f} s."]


def examine_installation(
    *, compile_all: Annotated[bool, Parameter(name="--compile", negative=())] = False,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Listing | Compilation:  # fmt: skip
    """Checks what this machine has and names the remedy; exit code 1 if something is missing.

    Args:
        compile_all: Compile the kernels of simulations and tension methods now, once, for later
            runs; nothing is examined then.
        follow: Who follows.

    Raises:
        StoppedError: It was stopped; what is compiled is kept.
    """
    if not compile_all:
        findings = [check() for check in CHECKS]  # where one fails the rest still run
        entries = [asdict(each) | ({"remedy": ""} if each.passed else {}) for each in findings]
        rows = [
            (entry["check"], "ok" if entry["passed"] else "missing", entry["found"],
             entry["remedy"])
            for entry in entries
        ]  # fmt: skip
        table = Table("cdpr doctor", ("check", "", "found", "remedy"), rows)
        return Listing(entries, table, code=0 if all(each.passed for each in findings) else 1)
    names, began = [LISTED, *(name for name, _ in compilation_steps())], time.perf_counter()
    count = Count(follow, len(names), unit="steps")
    for job in finished_jobs(compile_step, names, default_workers(), stop=follow.stop):
        if job.problem is not None:
            raise job.problem
        count.add(1, names[job.number])
    if count.done < len(names):
        raise StoppedError("stopped; what is compiled is kept")
    return Compilation(names, time.perf_counter() - began)


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

    default, projected = "acrobot_pbvs", "camera.kind=projected"
    steps: list[tuple[str, Callable[[], None]]] = [
        ("tension methods", _distribute),
        (default, partial(_simulate, default, projected)),
        (f"{default}, compiled engine",
         partial(_simulate, default, projected, "integration.engine=compiled")),
    ]  # fmt: skip
    for kind in (VISUAL_SERVO, TENSION_CONTROL, MECHANISM, PICK_AND_PLACE):
        overrides = [projected] if kind in (VISUAL_SERVO, PICK_AND_PLACE) else []
        steps += [
            (name, partial(_simulate, name, *overrides))
            for name in scenario_names(kind) if name != default
        ]  # fmt: skip
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


def _simulate(name: str, *overrides: str) -> None:
    from cdpr_drake.analyses.runs.simulate import simulate

    simulate(name, overrides, duration=PIECE)
