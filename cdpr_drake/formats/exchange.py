"""Robots and mechanisms from the files of other tools, and in them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cdpr_drake.analyses.frame.files import WrittenFiles, write_files
from cdpr_drake.analyses.frame.result import Result
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import ModelWord, NewFolder, OutFolder, one_of
from cdpr_drake.errors import RobotFileError
from cdpr_drake.formats.caspr import TOOL as CASPR
from cdpr_drake.formats.mechanism_exchange import (
    ImportedMechanism,
    export_mechanism,
    import_mechanism,
    is_foreign_mechanism,
)
from cdpr_drake.formats.robot_exchange import ImportedRobot, export_robot
from cdpr_drake.formats.robot_exchange import import_robot as read_robot
from cdpr_drake.formats.robot_exports import EXPORTS, export_omissions, omission_words
from cdpr_drake.models.mechanism_loader import load_mechanism
from cdpr_drake.models.robot_loader import load_robot, names_mechanism
from cdpr_drake.models.robot_schema import Robot

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class ForeignModel(Result):
    """A robot or mechanism from files of another tool.

    Attributes:
        model: What was read: what the file gave and lacked, and its file here.
        paths: Files that were written.
    """

    model: ImportedRobot | ImportedMechanism
    paths: Sequence[Path] = ()

    @property
    def robot(self) -> Robot:
        """The robot.

        Raises:
            RobotFileError: It is a mechanism.
        """
        if not isinstance(self.model, ImportedRobot):
            raise RobotFileError(f"{self.model.name}: found a mechanism; accepted: a robot")
        return self.model.robot

    def yaml(self) -> str:
        """The robot's or mechanism's file."""
        return self.model.completed.yaml()

    def files(self) -> dict[str, str]:
        """Text of the files of its folder, by their names."""
        if isinstance(self.model, ImportedMechanism):
            return self.model.files()
        return {"robot.yaml": self.model.yaml(), "README.md": self.model.readme()}

    def as_dict(self) -> dict[str, Any]:
        """What came from where; of a command the files that were written, too."""
        numbers = self.model.as_dict()
        head = {key: numbers.pop(key) for key in list(numbers)[:3]}  # name, format, source
        return {**head, "files": [str(path) for path in self.paths], **numbers}

    def lines(self) -> list[str]:
        """What it is, what was assumed, and the files that were written."""
        completed = self.model.completed
        if isinstance(self.model, ImportedMechanism):
            tree = self.model.tree
            words = (
                f"{self.model.name}: {len(tree.links)} links, {tree.coordinates} coordinates, "
                f"{len(tree.cables)} cables, from {CASPR}"
            )
        else:
            robot = self.model.robot
            words = (
                f"{robot.name}: {robot.motion}, {len(robot.cables)} cables, from {self.model.tool}"
            )
        assumed = [f"  assumed {key}: {why}" for key, why in completed.assumed.items()]
        notes = [f"  note: {remark}" for remark in completed.remarks]
        return [words, *assumed, *notes, *map(str, self.paths)]

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """A robot at its home pose."""
        return {"home": self._draw} if isinstance(self.model, ImportedRobot) else {}

    def _draw(self) -> Figure:
        from cdpr_drake.analyses.visualization.path_figures import poses_figure

        title = f"{self.robot.name} from {self.model.source.name}"
        return poses_figure(title, self.robot, {"home pose": self.robot.home.transform()})


@verb()
def import_robot(
    file: Path | str, /, *, name: str | None = None, model: str | None = None,
    cable_set: str | None = None, repair_inertia: bool = False,
) -> ForeignModel:  # fmt: skip
    """Reads a robot or mechanism from a file of another tool.

    Args:
        file: CASPR's XML, folder or list of models, WireX' wcrfx, the Gazebo simulator's YAML,
            GRAB's JSON, SDFormat, URDF or MJCF.
        name: Its name; None: the file's.
        model: Name of a model in a CASPR list.
        cable_set: Set of cables of a CASPR model; None: its default one.
        repair_inertia: Of CASPR's links: replace moments of inertia that no body can have.

    Raises:
        RobotFileError: The file is not accepted; one line for each problem.
    """
    path = Path(file)
    if is_foreign_mechanism(path, model):
        return ForeignModel(import_mechanism(
            path, name=name, model=model, cable_set=cable_set, repair_inertia=repair_inertia
        ))  # fmt: skip
    if repair_inertia:
        raise RobotFileError(
            f"repair_inertia: found with {path}; accepted: with a CASPR model of several links, "
            "or of joints that no platform on cables has"
        )
    return ForeignModel(read_robot(path, name=name, model=model, cable_set=cable_set))


def import_files(
    file: Path, /, *, out: OutFolder = None, name: str | None = None, model: str | None = None,
    cable_set: str | None = None, repair_inertia: bool = False, overwrite: bool = False,
) -> ForeignModel:  # fmt: skip
    """Imports a robot from a file of another tool into a folder.

    Writes robot.yaml, which every command takes, and a README that lists what the file states,
    what it lacks and what was assumed. Commands also take the foreign file itself.
    CASPR's models of several links give mechanism.yaml, and MJCF for links and joints.

    Args:
        file: CASPR's bodies or cables file, folder or list of models; wcrfx; the Gazebo simulator's
            YAML; GRAB's JSON; SDFormat; URDF; MJCF.
        out: Folder for the files; default: the robot's name.
        name: Name of the robot; default: the one in the file.
        model: Name of a model in a CASPR list, models_list.csv.
        cable_set: Set of cables of a CASPR model; default: the model's own default.
        repair_inertia: For links of CASPR: replace moments of inertia that no body can have, and
            those of rods without thickness, by the nearest that a body can have; each is named.
        overwrite: Replace files of these names.
    """
    imported = import_robot(
        file, name=name, model=model, cable_set=cable_set, repair_inertia=repair_inertia
    )
    kind = imported.model
    folder = out or Path(kind.name if isinstance(kind, ImportedMechanism) else kind.robot.name)
    return ForeignModel(kind, write_files(folder, imported.files(), overwrite))


@verb()
def export_files(
    robot: ModelWord, /, *, format: Annotated[str, one_of(EXPORTS)], out: NewFolder = Path(),
    overwrite: bool = False,
) -> WrittenFiles:  # fmt: skip
    """Exports a robot to the format of another tool.

    FORMATS

    What a format cannot hold is left out and named on stderr, field by field; with --json under
    not_written, by the fields' keys. Mechanisms go to caspr.

    Args:
        robot: Robot by name, or path of a robot file.
        format: Format of the files.
        out: Folder for the files.
        overwrite: Replace files of these names.

    Raises:
        RobotFileError: The robot or the format is not accepted.
        OutputFolderError: The files are there, or cannot be written.
    """
    if names_mechanism(robot):
        mechanism = load_mechanism(robot)
        about = {"mechanism": mechanism.name, "format": format}
        files, omitted = export_mechanism(mechanism, format)
    else:
        loaded = load_robot(robot, "cdpr export")
        about = {"robot": loaded.name, "format": format}
        files, omitted = export_robot(loaded, format), export_omissions(loaded, format)
    paths = write_files(out, files, overwrite)
    return WrittenFiles(about, paths, omission_words(omitted), {"not_written": omitted})


export_files.__doc__ = (export_files.__doc__ or "").replace(
    "FORMATS", "\n    ".join(f"- {name}: {words}" for name, words in EXPORTS.items())
)
