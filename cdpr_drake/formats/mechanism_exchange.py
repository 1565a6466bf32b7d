"""Mechanisms in and out of the files of CASPR."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant

from cdpr_drake.arrays import Array
from cdpr_drake.errors import RobotFileError
from cdpr_drake.formats.assumptions import CompletedDraft, import_readme
from cdpr_drake.formats.caspr import TOOL, is_caspr_tree, model_files
from cdpr_drake.formats.caspr_mechanism import write_mechanism
from cdpr_drake.formats.caspr_of_plant import LinksOfPlant, links_of_plant
from cdpr_drake.formats.caspr_pulleys import short_name
from cdpr_drake.formats.caspr_trees import (
    GRAVITY,
    CasprCable,
    CasprTree,
    excess,
    read_tree,
)
from cdpr_drake.formats.caspr_writer import CABLE_SET, write_tree
from cdpr_drake.formats.tree_assumptions import complete_tree
from cdpr_drake.geometry.cable_routes import CableRoutes
from cdpr_drake.models.foreign_text import robot_name
from cdpr_drake.models.mechanism_files import MECHANISM_FILE
from cdpr_drake.models.mechanism_in_plant import add_mechanism
from cdpr_drake.models.mechanism_loader import as_mechanism, load_mechanism
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.summaries import Summarized

MECHANISM_EXPORTS = ("caspr",)
"""Formats that mechanisms are written in."""

STRAIGHT_DOWN = 1e-12
"""Of gravity's direction, from which it may differ where a format has -z."""


@dataclass(frozen=True, repr=False)
class ImportedMechanism(Summarized):
    """A mechanism from the files of CASPR.

    Attributes:
        name: Its name.
        source: The file of its bodies.
        tree: Links, joints and cables as the files have them.
        completed: What the files gave and lacked, and the mechanism's file as a mapping.
    """

    name: str
    source: Path
    tree: CasprTree
    completed: CompletedDraft

    def files(self) -> dict[str, str]:
        """Text of the files of its folder, by their names: mechanism, bodies, README."""
        return {
            MECHANISM_FILE: self.completed.yaml(),
            f"{self.name}.xml": write_mechanism(self.tree),
            "README.md": import_readme(self.name, self.source.name, TOOL, self.completed),
        }

    def as_dict(self) -> dict[str, Any]:
        """What came from where, for JSON."""
        return {
            "mechanism": self.name,
            "format": TOOL,
            "source": str(self.source),
            "links": len(self.tree.links),
            "coordinates": self.tree.coordinates,
            "cables": len(self.tree.cables),
            "given": list(self.completed.given),
            "assumed": self.completed.assumed,
            "remarks": list(self.completed.remarks),
        }

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """Title and rows of its table."""
        tree, made = self.tree, self.completed
        return f"Mechanism {self.name} from {TOOL}", [
            ("source", str(self.source)),
            ("links, coordinates", f"{len(tree.links)}, {tree.coordinates}"),
            ("cables", f"{len(tree.cables)}"),
            ("assumed", ", ".join(made.assumed) or "nothing"),
            *(("remark", words) for words in made.remarks[:4]),
        ]


def is_foreign_mechanism(path: Path, model: str | None = None) -> bool:
    """Whether a path is that of a model that `import_mechanism` reads, and no robot.

    Args:
        path: File, folder or list of models.
        model: Name of a model in a list.

    Raises:
        RobotFileError: A list has no such model, or a file cannot be read.
    """
    if not path.exists() or (path.is_file() and path.suffix.lower() not in (".xml", ".csv")):
        return False
    try:
        bodies, _, _ = model_files(path, model)
    except RobotFileError:
        return False  # no model of CASPR; whose reader says what is wrong with it
    return is_caspr_tree(bodies)


def import_mechanism(
    path: Path | str,
    *,
    name: str | None = None,
    model: str | None = None,
    cable_set: str | None = None,
    repair_inertia: bool = False,
) -> ImportedMechanism:
    """Reads a CASPR model of several links, or of joints that a platform does not have.

    Args:
        path: Its bodies or cables file, its folder, or a list of models.
        name: Name of the mechanism; None: the model's.
        model: Name of a model in a list.
        cable_set: Set of cables; None: the default one of the file.
        repair_inertia: Whether moments of inertia that no body can have, and those of rods without
            thickness, become the nearest that a body can have; remarks name each.

    Returns:
        The mechanism; its `files()` in one folder are what `load_mechanism` takes.

    Raises:
        RobotFileError: The files are not accepted; one line for each problem.
    """
    bodies, cables, words = model_files(Path(path), model)
    tree = read_tree(bodies, cables, words, cable_set, repair_inertia)
    chosen = robot_name(words) if name is None else name
    imported = ImportedMechanism(chosen, bodies, tree, complete_tree(tree, chosen))
    with TemporaryDirectory() as folder:
        for file, text in imported.files().items():
            (Path(folder) / file).write_text(text, encoding="utf-8")
        try:
            load_mechanism(Path(folder) / MECHANISM_FILE)
        except RobotFileError as problem:
            made = str(Path(folder) / MECHANISM_FILE)
            told = str(problem).replace(made, str(bodies)) + _thin(tree, repair_inertia)
            raise RobotFileError(told) from problem
    return imported


def _thin(tree: CasprTree, repaired: bool) -> str:
    """What might help if Drake refuses a tree: a word on links without thickness or inertia."""
    found = [
        link.name
        for link in tree.links
        if link.mass > 0.0 and (excess(link.inertia) >= 0.0 or not np.any(link.inertia))
    ]
    if not found:
        return ""
    if repaired:  # moments of 0 stay 0: nothing says how large the link is
        return f"; accepted: moments of inertia above 0 in the file, of {', '.join(found)}"
    return f"; links without thickness, which --repair-inertia gives them: {', '.join(found)}"


def export_mechanism(
    mechanism: Mechanism | str | Path, format: str = "caspr"
) -> tuple[dict[str, str], dict[str, str]]:
    """Files of a mechanism at home in the format of another tool.

    Args:
        mechanism: The mechanism, or its name or path.
        format: One of `MECHANISM_EXPORTS`.

    Returns:
        Text of each file, by its name; and what the format does not hold, by the keys of the
        mechanism's file with what became of each.

    Raises:
        RobotFileError: There is no such format, or it cannot hold this mechanism.
    """
    mechanism = as_mechanism(mechanism)
    if format not in MECHANISM_EXPORTS:
        raise RobotFileError(
            f"mechanism {mechanism.name}: format: found {format}; accepted for cables between "
            f"frames of a plant: {', '.join(MECHANISM_EXPORTS)}"
        )
    if np.max(np.abs(mechanism.down() - (0.0, 0.0, -1.0))) > STRAIGHT_DOWN:
        raise RobotFileError(
            f"mechanism {mechanism.name}: gravity_direction: found "
            f"{np.round(mechanism.down(), 6).tolist()}; accepted for caspr: along -z"
        )
    tree, lost = tree_of_mechanism(mechanism)
    files = {f"{mechanism.name}_{part}.xml": text for part, text in write_tree(tree).items()}
    return files, lost


def tree_of_mechanism(mechanism: Mechanism) -> tuple[CasprTree, dict[str, str]]:
    """A mechanism at home as links of CASPR and their cables, and what these do not hold.

    Raises:
        RobotFileError: CASPR has no joint of a kind that is there; names it.
    """
    plant = MultibodyPlant(0.0)
    added = add_mechanism(plant, mechanism)
    added.finalize()
    routes, context = added.routes(), plant.CreateDefaultContext()
    made = links_of_plant(plant, context, set(routes.touched_bodies()))
    lost = {"mechanism": ", ".join([*made.lost, "names of joints", "end_location of links"])}
    lost |= _not_held(mechanism)
    lower, upper = mechanism.tension_limits()
    cables, points_W = [], []
    for i, name in enumerate(routes.names):
        first, last = int(routes.first[i]), int(routes.first[i + 1])
        bodies = [int(body) for body in routes.bodies[first:last]]
        points = [
            made.X_LB[body].multiply(p)
            for body, p in zip(bodies, routes.p_BQ[:, first:last].T, strict=True)
        ]
        points_W.append(points[0] if made.host[bodies[0]] == 0 else np.zeros(3))
        radius, entry = _pulley(routes, i, made, bodies[0], lost)
        cables.append(
            CasprCable(
                name=name, links=tuple(made.host[body] for body in bodies),
                points=np.array(points).T, lower=lower, upper=upper,
                stiffness=float(routes.ends.stiffness[i]),
                diameter=mechanism.materials()[i].diameter, pulley_radius=radius, entry=entry,
            )
        )  # fmt: skip
    changed = [f"{name!r} is {short_name(name)}" for name in routes.names
               if short_name(name) != name]  # fmt: skip
    if changed:
        lost["cables[].name"] = "is read back: " + ", ".join(changed)
    tree = CasprTree(
        name=mechanism.name, links=tuple(made.links), cables=tuple(cables), cable_set=CABLE_SET,
        display=_display(np.array(points_W)),
    )  # fmt: skip
    return tree, lost


def _pulley(
    routes: CableRoutes, i: int, made: LinksOfPlant, body: int, lost: dict[str, str]
) -> tuple[float, Array]:
    """Radius and entry direction of the pulley at an exit point of the world."""
    ends = routes.ends
    axis = made.X_LB[body].rotation().multiply(ends.swivel_axis[:, i])
    radius = float(ends.pulley_radius[i])
    if radius and made.host[body] != 0:
        lost["cables[].pulley_radius"] = "pulleys on links were written as points"
        radius = 0.0
    if ends.anchor_pulley_radius[i]:
        lost["cables[].anchor_pulley_radius"] = "cables end in points there"
    return radius, np.asarray(axis)


def _display(points: Array) -> Array:
    """Corners of a box round points, x x y y z z, a tenth wider and a metre wide at least."""
    low, high = points.min(axis=0), points.max(axis=0)
    wide = np.maximum(1.1 * (high - low), 1.0)
    middle = (low + high) / 2.0
    return np.asarray(np.column_stack([middle - wide / 2.0, middle + wide / 2.0]).ravel())


def _not_held(mechanism: Mechanism) -> dict[str, str]:
    """Keys of the mechanism's file that CASPR has no place for."""
    words = "caspr has no place for it"
    lost = dict.fromkeys(("cable.linear_density", "cable.retardation_time"), words)
    if mechanism.title:
        lost["title"] = words
    if mechanism.gravity != GRAVITY:
        lost["gravity"] = f"caspr has {GRAVITY:g} m/s^2"
    if any(material.breaking_load is not None for material in mechanism.materials()):
        lost["cable.breaking_load"] = words
    return lost
