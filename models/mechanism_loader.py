"""Finds, reads and checks files of mechanisms."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.multibody.parsing import PackageMap
from pydrake.multibody.plant import MultibodyPlant

from cdpr_drake.errors import CdprError, Problems, RobotFileError
from cdpr_drake.models.drake_parsing import drake_line, package_name
from cdpr_drake.models.materials import check_materials
from cdpr_drake.models.mechanism_files import is_mechanism
from cdpr_drake.models.mechanism_in_plant import MODEL_SUFFIXES, add_mechanism
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.robot_loader import LARGEST_LENGTH, load_robot, robot_file
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.input_files import input_there
from cdpr_drake.schema.typed_yaml import load_typed, parse_typed

URL = "package://"
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
    mechanism = load_typed(Mechanism, path, error=RobotFileError)
    _check(mechanism, path)
    return mechanism


def parse_mechanism(content: str, path: Path) -> Mechanism:
    """A mechanism from the text of its file.

    Args:
        content: YAML.
        path: The file that messages name, and beside which others are looked for.

    Raises:
        RobotFileError: As `load_mechanism`.
    """
    mechanism = parse_typed(Mechanism, content, path, error=RobotFileError)
    _check(mechanism, path)
    return mechanism


def load_robot_or_mechanism(name: str | Path) -> Robot | Mechanism:
    """A robot with one platform, or a mechanism, by name or path.

    Raises:
        RobotFileError: As `load_robot` or `load_mechanism`.
    """
    return load_mechanism(name) if is_mechanism(robot_file(str(name))) else load_robot(name)


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


def as_robot_or_mechanism(robot: Robot | Mechanism | str | Path) -> Robot | Mechanism:
    """As `load_robot_or_mechanism`, where it may be given as itself.

    Raises:
        RobotFileError: As `load_robot_or_mechanism`, or it is something else.
    """
    if isinstance(robot, Robot | Mechanism):
        return robot
    if isinstance(robot, str | Path):
        return load_robot_or_mechanism(robot)
    raise RobotFileError(
        f"robot: found a {type(robot).__name__}; accepted: a name, a path, a Robot or a Mechanism"
    )


def _check(mechanism: Mechanism, path: Path) -> None:
    """What no single field can tell."""
    problems = Problems(RobotFileError)

    def fail(field: str, found: object, accepted: str) -> None:
        problems.add(f"{path}: {field}: found {found}; accepted: {accepted}")

    bounds = mechanism.tension_bounds
    if bounds.lower >= bounds.upper:
        fail("tension_bounds", f"lower {bounds.lower:g}, upper {bounds.upper:g}", "lower < upper")
    if not np.any(mechanism.gravity_direction):
        fail("gravity_direction", "(0, 0, 0)", "a direction, not zero")
    if mechanism.gravity > 1e3:
        fail("gravity", f"{mechanism.gravity:g}", "at most 1000 [m/s^2]")
    if not mechanism.cables:
        fail("cables", "none", "at least one cable")
    check_materials(mechanism.cable, [cable.material for cable in mechanism.cables], fail)
    if mechanism.cable.behaviour is not None:
        fail("cable.behaviour", "a section", "null: mechanisms have elastic cables")
    _check_cables(mechanism, fail)
    _find_packages(mechanism, path, fail)
    _find_model(mechanism, path, fail)
    problems.raise_any()
    _check_in_plant(mechanism, path)


def _check_cables(mechanism: Mechanism, fail: Callable[[str, object, str], None]) -> None:
    names = [cable.name for cable in mechanism.cables]
    pulleys = {"pulley": mechanism.pulley, "anchor_pulley": mechanism.anchor_pulley}
    axes = {f"{key}.swivel_axis": one.swivel_axis for key, one in pulleys.items() if one}
    for index, cable in enumerate(mechanism.cables):
        key = f"cables[{index}]"
        if cable.name in names[:index]:
            fail(f"{key}.name", f"{cable.name} twice", "each name once")
        for where, _, point in cable.route():
            if np.any(np.abs(point) > LARGEST_LENGTH):
                at = where.replace("frame", "point")
                fail(f"{key}.{at}", point.tolist(), f"at most {LARGEST_LENGTH:g} [m]")
        for end in ("swivel_axis", "anchor_swivel_axis"):
            if getattr(cable, end) is not None:
                axes[f"{key}.{end}"] = getattr(cable, end)
    for key, axis in axes.items():
        if not np.any(axis):
            fail(key, "(0, 0, 0)", "a direction, not zero")


def _find_packages(
    mechanism: Mechanism, path: Path, fail: Callable[[str, object, str], None]
) -> None:
    """Makes given folders absolute, and adds packages that lie near the file."""
    here = path.absolute().parent
    given = {}
    for name, folder in mechanism.packages.items():
        where = (here / folder).resolve()
        if not where.is_dir():
            fail(f"packages.{name}", folder, "a folder")
        given[name] = str(where)
    below = sorted(here.iterdir()) if here.is_dir() else []  # gone, where its files were read
    near = [here, *here.parents, *(child for child in below if child.is_dir())]
    found, elsewhere = PackageMap.MakeEmpty(), PackageMap.MakeEmpty()
    elsewhere.PopulateFromRosPackagePath()
    for manifest in (folder / MANIFEST for folder in near):
        if manifest.is_file():
            try:
                found.AddPackageXml(str(manifest))
            except RuntimeError:  # no manifest, or a second package of that name
                continue
        elif (held := package_name(manifest)) is not None:
            given.setdefault(held, str(manifest.parent))
    for name in found.GetPackageNames():
        given.setdefault(name, found.GetPath(name))
    for name in elsewhere.GetPackageNames():
        given.setdefault(name, elsewhere.GetPath(name))
    mechanism.packages = given


def _find_model(mechanism: Mechanism, path: Path, fail: Callable[[str, object, str], None]) -> None:
    """Makes the name of the file of bodies absolute."""
    given = mechanism.mechanism
    if given.startswith(URL):
        packages = PackageMap()
        for name, folder in mechanism.packages.items():
            if not packages.Contains(name):
                packages.Add(name, folder)
        package = given.removeprefix(URL).partition("/")[0]
        if not packages.Contains(package):
            known = ", ".join(mechanism.packages) or "none is known"
            fail("mechanism", given, f"a file of a package: {known}; or the key packages")
            return
        try:
            file = Path(packages.ResolveUrl(given))
        except RuntimeError as problem:
            fail("mechanism", f"{given}: {drake_line(problem)}", "a file of that package")
            return
    else:
        file = path.absolute().parent / given
    if not file.name.lower().endswith(MODEL_SUFFIXES):
        fail("mechanism", given, f"a file that ends in {', '.join(MODEL_SUFFIXES)}")
    elif not input_there(file):
        fail("mechanism", given, "a file that is there")
    else:
        mechanism.mechanism = str(file)


def _check_in_plant(mechanism: Mechanism, path: Path) -> None:
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
