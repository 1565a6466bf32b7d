"""Finds, reads and checks files of mechanisms."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.multibody.parsing import PackageMap
from pydrake.multibody.plant import MultibodyPlant

from cdpr_drake.errors import CdprError, RobotFileError
from cdpr_drake.models.drake_parsing import package_name
from cdpr_drake.models.mechanism_files import is_mechanism
from cdpr_drake.models.mechanism_in_plant import add_mechanism
from cdpr_drake.models.mechanism_schema import URL, Mechanism
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import Scope
from cdpr_drake.schema.input_files import input_there
from cdpr_drake.schema.typed_yaml import load_typed, parse_typed

MANIFEST = "package.xml"

LEAST_INERTIA = 1e-12
"""An eigenvalue of the mass matrix below this share of the largest: a joint that moves nothing."""

LARGEST_INERTIA = 1e15
"""Of the mass matrix [kg, kg m^2]: 1e7 kg at 10 km, as the largest of robots with one platform."""


def load_mechanism(name: str | Path) -> Mechanism:
    """Reads a mechanism by name or by path.

    Its `mechanism` and `packages` are absolute afterwards.

    Args:
        name: A name of `mechanism_names()`, or the path of a file or folder.

    Raises:
        RobotFileError: There is no such file, it is that of a robot with one platform, Drake cannot
            read its bodies, or a frame, joint or body is not there; names file, field and value.
    """
    path = robot_file(str(name))
    if not is_mechanism(path):
        load_robot(path)  # what is wrong with a file that is neither
        raise RobotFileError(
            f"{path}: found a robot with one platform; accepted: a file with the key mechanism"
        )
    return _checked_in_plant(
        load_typed(
            Mechanism, path, error=RobotFileError, scope=lambda mechanism: _scope(mechanism, path)
        ),
        path,
    )


def parse_mechanism(content: str, path: Path) -> Mechanism:
    """A mechanism from the text of its file.

    Args:
        content: YAML.
        path: The file that messages name; further files are searched in its folder.

    Raises:
        RobotFileError: As `load_mechanism`.
    """
    return _checked_in_plant(
        parse_typed(
            Mechanism, content, path, error=RobotFileError,
            scope=lambda mechanism: _scope(mechanism, path),
        ),
        path,
    )  # fmt: skip


def load_robot_or_mechanism(robot: Robot | Mechanism | str | Path) -> Robot | Mechanism:
    """A robot with one platform, or a mechanism, that is given as itself, or by name or path.

    Raises:
        RobotFileError: As `load_robot` or `load_mechanism`, or it is something else.
    """
    if isinstance(robot, Robot | Mechanism):
        return robot
    if isinstance(robot, str | Path):
        return load_mechanism(robot) if is_mechanism(robot_file(str(robot))) else load_robot(robot)
    raise RobotFileError(
        f"robot: found a {type(robot).__name__}; accepted: a name, a path, a Robot or a Mechanism"
    )


def as_mechanism(mechanism: Mechanism | str | Path) -> Mechanism:
    """A mechanism that is given as itself, or by name or path.

    Raises:
        RobotFileError: As `load_mechanism`, or it is something else.
    """
    if isinstance(mechanism, Mechanism):
        return mechanism
    if isinstance(mechanism, str | Path):
        return load_mechanism(mechanism)
    raise RobotFileError(
        f"mechanism: found a {type(mechanism).__name__}; accepted: a name, a path or a Mechanism"
    )


def _scope(mechanism: Mechanism, path: Path) -> Scope:
    """Makes folders of packages and the file of bodies absolute, and adds packages near it."""
    here = path.absolute().parent
    folders = {name: str((here / at).resolve()) for name, at in mechanism.packages.items()}
    missing = [name for name, folder in folders.items() if not Path(folder).is_dir()]
    refused = [(f"packages.{name}", mechanism.packages[name], "a folder") for name in missing]
    below = sorted(here.iterdir()) if here.is_dir() else []  # gone, where its files were read
    near = [here, *here.parents, *(child for child in below if child.is_dir())]
    found, elsewhere = PackageMap.MakeEmpty(), PackageMap.MakeEmpty()
    elsewhere.PopulateFromRosPackagePath()
    for manifest in (folder / MANIFEST for folder in near):
        if manifest.is_file():
            with suppress(RuntimeError):  # no manifest, or a second package of that name
                found.AddPackageXml(str(manifest))
        elif (held := package_name(manifest)) is not None:
            folders.setdefault(held, str(manifest.parent))
    for packages in (found, elsewhere):
        for name in packages.GetPackageNames():
            folders.setdefault(name, packages.GetPath(name))
    mechanism.packages = folders
    if mechanism.mechanism.startswith(URL):
        known = PackageMap()
        for name, folder in folders.items():
            if not known.Contains(name) and Path(folder).is_dir():
                known.Add(name, folder)
        with suppress(RuntimeError):  # no such package, or no such file
            mechanism.mechanism = known.ResolveUrl(mechanism.mechanism)
    elif input_there(here / mechanism.mechanism):
        mechanism.mechanism = str(here / mechanism.mechanism)
    return Scope(mechanism, path, more=(lambda scope: iter(refused),))


def _checked_in_plant(mechanism: Mechanism, path: Path) -> Mechanism:
    """Builds it once, so that all that Drake refuses is said with the file."""
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)  # so that shapes are looked at, too
    try:
        added = add_mechanism(plant, mechanism)
        added.finalize()
        context = plant.CreateDefaultContext()
        PlantCables(plant, added.routes()).lengths_and_jacobian(context)
    except RobotFileError as problem:
        raise RobotFileError(*problem.within(str(path))) from problem
    except CdprError as problem:
        raise RobotFileError(f"{path}: cables: at the home positions, {problem}") from problem
    if not plant.num_velocities():
        raise RobotFileError(
            f"{path}: mechanism: found {Path(mechanism.mechanism).name}, in which nothing moves; "
            "accepted: bodies with joints, or free ones"
        )
    M = plant.CalcMassMatrix(context)
    if not np.all(np.isfinite(M)) or np.max(np.abs(M)) > LARGEST_INERTIA:
        raise RobotFileError(
            f"{path}: mechanism: found an inertia beyond {LARGEST_INERTIA:g} kg or kg m^2 in "
            f"{Path(mechanism.mechanism).name}; accepted: bodies of masses and sizes that make "
            "sense"
        )
    values = np.linalg.eigvalsh(M)
    if not values[0] > LEAST_INERTIA * values[-1]:
        raise RobotFileError(
            f"{path}: mechanism: found a joint of {Path(mechanism.mechanism).name} that moves no "
            "mass; accepted: bodies with mass and inertia"
        )
    return mechanism
