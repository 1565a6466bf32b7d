"""Provenance of results: the versions and sources that computed them, and a run's input files.

`package_versions` and `code_version` say what computed a result, and whether the code is still the
same. `write_run_inputs` puts robot, scenario and motion beside a run's results, so that somebody
else can repeat it from the folder.
"""

from __future__ import annotations

import hashlib
import platform
import shutil
from collections.abc import Collection
from dataclasses import replace
from functools import cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

from cdpr_drake.analyses.reporting.log_files import write_scenario, write_whole
from cdpr_drake.analyses.reporting.written_files import whole_file
from cdpr_drake.models.camera_files import CAMERA_SUFFIXES
from cdpr_drake.models.mechanism_loader import load_mechanism
from cdpr_drake.models.mechanism_schema import MODEL_SUFFIXES
from cdpr_drake.models.robot_copies import portable_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.input_files import input_bytes
from cdpr_drake.schema.typed_yaml import dump_typed, plain_values
from cdpr_drake.version import __version__

PACKAGES = ("cdpr_drake", "cdpr_drake.models", "cdpr_drake.systems", "cdpr_drake.analyses")
"""Whose sources numbers depend on."""

SUFFIXES = (".py", ".yaml")
"""Files that count."""


def package_versions() -> dict[str, str]:
    """Versions that a result depends on."""
    return {"python": platform.python_version(), **_versions()}


@cache
def _versions() -> dict[str, str]:
    """Those of packages, read once in a process: their metadata are files."""
    others = {name: version(name) for name in ("drake", "numpy", "numba")}
    return {"cdpr_drake": __version__, **others}


@cache
def code_version() -> str:
    """Version of cdpr_drake and a hash of its sources and robots, but for the command line and the
    facts that judge studies.

    Sweeps keep it beside their chunks, so that chunks of other code are not taken for their own.
    """
    folders = [Path(import_module(name).__path__[0]) for name in PACKAGES]
    without = folders[0] / "cli", folders[-1] / "studies" / "facts"
    return f"{__version__} {hash_of_sources(folders, without)}"


def hash_of_sources(folders: list[Path], without: Collection[Path] = ()) -> str:
    """Twelve digits that change with the sources and data in folders, wherever the folders are.

    Args:
        folders: Some may lie in others.
        without: Folders that do not count.
    """
    found: dict[Path, str] = {}
    for folder in folders:  # a file counts with its place in the innermost folder
        for path in folder.rglob("*"):
            if path.suffix in SUFFIXES and not {*without} & {*path.parents}:
                place = f"{folder.name}/{path.relative_to(folder).as_posix()}"
                if path not in found or len(place) < len(found[path]):
                    found[path] = place
    hashed = hashlib.sha256()
    for path, place in sorted(found.items(), key=lambda item: item[1]):
        hashed.update(place.encode() + b"\0" + path.read_bytes() + b"\0")
    return hashed.hexdigest()[:12]


ROBOT_FILE = "robot.yaml"
"""The robot of a run, in its folder."""

MOTION_FILE = "motion.csv"
"""The motion that it tracked, if that came from a file."""

MECHANISM_FILE = "mechanism.yaml"
"""The mechanism of a run, in its folder."""

BELIEVED_FILE = "believed_robot.yaml"
"""The robot that its controller believes in, if it is another one."""


def write_run_inputs(folder: Path, scenario: Any, robot: Robot) -> None:
    """Writes robot and scenario as they were run, overrides included, into an existing folder.

    The mesh of a platform is copied beside them.

    The scenario names the robot's file beside it, so an installed robot of the same name does not
    count when the folder is run again; so it does for a robot that its controller believes in, and
    for the file of a motion.

    Args:
        folder: Where to.
        scenario: A dataclass with the field `robot`.
        robot: The robot that was simulated.
    """
    written = replace(scenario, robot=_write(folder / ROBOT_FILE, robot))
    perturbations = getattr(scenario, "perturbations", None)
    if perturbations is not None and getattr(perturbations, "believed_robot", None) is not None:
        believed = _write(folder / BELIEVED_FILE, load_robot(perturbations.believed_robot))
        written.perturbations = replace(perturbations, believed_robot=believed)
    camera = getattr(scenario, "camera", None)
    for section, key in ((camera, "model"), (perturbations, "camera_model")):
        file = getattr(section, key, None)
        if file is not None and file.lower().endswith(CAMERA_SUFFIXES):
            name = f"{key}{Path(file).suffix}"
            _copy(Path(file), folder / name)
            where = "camera" if section is camera else "perturbations"
            setattr(written, where, replace(getattr(written, where), **{key: name}))
    trajectory = getattr(scenario, "trajectory", None)
    if trajectory is not None and getattr(trajectory, "file", None) is not None:
        _copy(Path(trajectory.file), folder / MOTION_FILE)
        written.trajectory = replace(trajectory, file=MOTION_FILE)
    write_scenario(folder / "scenario.yaml", written)


def write_mechanism(folder: Path, name: str) -> str:
    """Writes a mechanism into an existing folder; gives its file's name there.

    It names the files of its bodies and packages where they are: on another machine they are not.
    """
    write_whole(folder / MECHANISM_FILE, dump_typed(load_mechanism(name)))
    return MECHANISM_FILE


def mechanism_arguments(name: str) -> dict[str, Any]:
    """All that a mechanism is, for JSON: its file, and hashes of the models in the folder of its
    bodies."""
    mechanism = load_mechanism(name)
    folder = Path(mechanism.mechanism).parent
    files = [each for each in sorted(folder.iterdir()) if each.name.endswith(MODEL_SUFFIXES)]
    hashes = {each.name: hashlib.sha256(input_bytes(each)).hexdigest() for each in files}
    return {"mechanism": plain_values(mechanism), "bodies": hashes}


def _write(path: Path, robot: Robot) -> str:
    """Writes a robot with the files that it names beside it; gives its own file's name."""
    portable, files = portable_robot(robot)
    for file in files:
        _copy(file, path.parent / file.name)
    write_whole(path, dump_typed(portable))
    return path.name


def _copy(file: Path, path: Path) -> None:
    """Copies a file, whole or not at all."""
    with whole_file(path) as part:
        part.write_bytes(input_bytes(file))


BROWSERS = ("chromium", "google-chrome", "chrome", "msedge")
"""Programs that print pages."""


def browser() -> str | None:
    """A browser of this machine that prints pages without a window; None: there is none."""
    return next(filter(None, map(shutil.which, BROWSERS)), None)
