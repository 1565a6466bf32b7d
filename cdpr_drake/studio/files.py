"""The folder that the studio works in, and robots in and out of files: names, uploads, other tools.

No path leads out of the folder. What is read is data: YAML without tags, XML without entities,
nothing that is executed. A file can name others, as a robot its mesh or MJCF what it includes;
those have to lie in the folder, or where the robot itself is.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path, PurePath
from secrets import token_hex
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

from cdpr_drake.errors import CdprError, OutputFolderError, RobotFileError
from cdpr_drake.formats.robot_exchange import import_robot
from cdpr_drake.models.file_kinds import SUFFIXES as ROBOT_SUFFIXES
from cdpr_drake.models.file_kinds import is_foreign
from cdpr_drake.models.robot_loader import parse_robot, robot_file, robot_names, robot_text
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.yaml_files import YamlTextError, load_yaml, too_many_bytes
from cdpr_drake.studio.document import value_in

MOST_FILES = 500
"""Files that are listed at most."""


def is_within(path: Path, *folders: Path) -> bool:
    """Whether a path leads, also by links, into one of some folders, which are resolved."""
    with suppress(OSError, RuntimeError, ValueError):
        return any(path.resolve().is_relative_to(folder) for folder in folders)
    return False


class WorkingFolder:
    """A folder whose files may be read and written."""

    def __init__(self, root: Path) -> None:
        """Of a folder; raises CdprError where it is none."""
        if not root.is_dir():
            raise CdprError(f"{root}: found no folder; accepted: one that exists, to work in")
        self.root = root.resolve()

    def path(self, name: str) -> Path:
        """The path of a file or folder in it, by its name relative to the folder.

        Raises:
            CdprError: The name leads out of the folder, also by a link, or is none.
        """
        name = name.strip()
        if not name or not name.isprintable():
            raise CdprError(f"name: found {name!r}; accepted: a name in the working folder")
        try:
            path = (self.root / name).resolve()
        except (OSError, RuntimeError) as problem:
            raise CdprError(f"{name[:200]}: cannot be used as a name: {problem}") from problem
        if not path.is_relative_to(self.root):
            raise CdprError(
                f"{name[:200]}: leads out of the working folder; accepted: a name in {self.root}"
            )
        return path

    def shown(self, path: Path) -> str:
        """A path relative to the folder, as the page shows it."""
        return str(path.relative_to(self.root)) if path.is_relative_to(self.root) else path.name

    def files(self, suffixes: tuple[str, ...]) -> list[str]:
        """Names of files with these endings, here and one folder below, sorted."""
        paths = [path for at in ("*", "*/*") for path in sorted(self.root.glob(at))]
        names = (
            self.shown(path) for path in paths
            if path.suffix.lower() in suffixes and path.is_file()
        )  # fmt: skip
        return list(islice((name for name in names if "/." not in f"/{name}"), MOST_FILES))

    def write(self, name: str, text: str, overwrite: bool) -> Path:
        """Writes a file at once, or not at all.

        Raises:
            CdprError: The name leads out of the folder.
            OutputFolderError: The file is there and may not be replaced, or the disk is full.
        """
        path = self.path(name)
        if path.exists() and not overwrite:
            raise OutputFolderError(f"{self.shown(path)}: is there already; replace it, or rename")
        part = path.with_name(f".part-{token_hex(8)}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            part.write_text(text, encoding="utf-8")
            part.replace(path)
        except OSError as problem:
            with suppress(OSError):  # it may not be there
                part.unlink()
            words = problem.strerror or problem
            raise OutputFolderError(f"{self.shown(path)}: cannot be written: {words}") from problem
        return path


LARGEST_UPLOAD = 4_194_304
"""Of a file of another tool [bytes], as its readers have it."""

MOST_UPLOADS = 8
"""Files at once; a CASPR model has several."""

UPLOADS = tuple(suffix for suffix in ROBOT_SUFFIXES if suffix != ".csv")
"""Endings of files that can be uploaded; lists of models need the folders that they name."""

NAMED_FILES = ("file", "filename", "meshdir", "texturedir", "assetdir", "url")
"""Attributes of XML files that name other files."""


@dataclass(frozen=True)
class OpenedRobot:
    """A robot that was read.

    Attributes:
        text: That of a robot file.
        path: Where messages say that it stands.
        notes: What to know of a file of another tool, a sentence each.
        name: Of the package, or of the file of the folder that has the text; empty: neither.
    """

    text: str
    path: Path
    notes: list[str]
    name: str = ""


class RobotFiles:
    """Reads robots for a workbench."""

    def __init__(self, folder: WorkingFolder, also: Path | None = None) -> None:
        """Of a working folder, and of one more folder that the user has named at the start."""
        self._folder = folder
        shipped = robot_file(robot_names()[0]).parent.parent
        self._roots = [root.resolve() for root in (folder.root, shipped, also) if root is not None]

    def read(self, text: str, path: Path) -> Robot:
        """A robot from the text of a robot file.

        Raises:
            RobotFileError: The text is too long, does not describe a possible robot, or names a
                file that lies elsewhere.
        """
        mesh = None
        with suppress(YamlTextError):  # the reader of robots says what is wrong
            mesh = value_in(load_yaml(text), ("platform", "shape", "file"))
        if isinstance(mesh, str) and not is_within(path.parent / mesh, *self._roots):
            raise RobotFileError(
                f"{path}: platform.shape.file: found {mesh[:80]!r}, outside of the working "
                "folder; accepted: a file in it"
            )
        return parse_robot(text, path)

    def open(self, name: str) -> OpenedRobot:
        """A robot of the package by name, or the file of the working folder of that name.

        Raises:
            CdprError: There is none, its file leads out of the folder, or it is not accepted.
        """
        if name in robot_names():
            return OpenedRobot(robot_text(name), robot_file(name).resolve(), [], name)
        path = self._folder.path(name)
        if not path.is_file():
            raise RobotFileError(f"{name[:200]}: there is no such file in the working folder")
        return self._read_file(path, path.parent)

    def _read_file(self, path: Path, folder: Path) -> OpenedRobot:
        """The robot of a file, which stands in a folder from now on."""
        notes: list[str] = []
        where = folder / path.name
        if path.suffix.lower() not in UPLOADS:
            raise RobotFileError(
                f"{path.name[:100]}: found the ending {path.suffix[:20]!r}; accepted: "
                f"{', '.join(UPLOADS)}"
            )
        if is_foreign(path):
            _check_names(path)
            imported = import_robot(path)
            completed, text = imported.completed, imported.yaml()
            notes = [f"read as {imported.tool}"]
            notes += [f"assumed {key}: {words}" for key, words in completed.assumed.items()]
            notes += [words.replace(f"{path.parent}/", "") for words in completed.remarks]
            where = where.with_suffix(".yaml")
        else:
            if large := too_many_bytes(path):
                raise RobotFileError(f"{path.name}: {large}")
            try:
                text = path.read_text(encoding="utf-8")
            except UnicodeDecodeError as problem:
                raise RobotFileError(f"{path.name}: cannot be read: {problem}") from problem
        self.read(text, where)
        is_own = where == path and not notes
        return OpenedRobot(text, where, notes, self._folder.shown(path) if is_own else "")

    def upload(self, files: Mapping[str, bytes]) -> OpenedRobot:
        """A robot from files that came over the network, by their names; one, or those of a model.

        Raises:
            CdprError: They are too many or too large, or none of them is accepted as a robot.
        """
        if not 0 < len(files) <= MOST_UPLOADS:
            raise RobotFileError(f"found {len(files)} files; accepted: 1 to {MOST_UPLOADS}")
        problems: list[str] = []
        with TemporaryDirectory(prefix="cdpr-studio-") as scratch:
            for path in [_put(Path(scratch), *item) for item in files.items()]:
                try:
                    return self._read_file(path, self._folder.root)
                except CdprError as problem:
                    problems += str(problem).replace(f"{scratch}/", "").split("\n")
        raise RobotFileError(*problems)


def _put(folder: Path, name: str, content: bytes) -> Path:
    """Writes a file that came over the network."""
    plain = PurePath(name.replace("\\", "/")).name
    if not plain or plain.startswith(".") or not plain.isprintable() or len(plain) > 100:
        raise RobotFileError(f"name: found {name[:80]!r}; accepted: the name of a file")
    if len(content) > LARGEST_UPLOAD:
        raise RobotFileError(
            f"{plain}: found {len(content):,} bytes; accepted: at most {LARGEST_UPLOAD:,}"
        )
    path = folder / plain
    path.write_bytes(content)
    return path


def _check_names(path: Path) -> None:
    """Refuses XML that names files elsewhere, before anybody follows them."""
    if path.suffix.lower() in (".yaml", ".yml", ".json") or path.stat().st_size > LARGEST_UPLOAD:
        return  # which name none, or are refused for their size
    try:
        root = ElementTree.fromstring(path.read_bytes())
    except (ElementTree.ParseError, ValueError, LookupError):
        return  # the reader says what is wrong
    for element in root.iter():
        tag, names = str(element.tag), [element.get(key, "") for key in NAMED_FILES]
        if tag.rpartition("}")[2] in ("uri", "include"):
            names.append((element.text or "").strip())
        for words in names:
            where = words.partition("://")[2] if "://" in words else words
            if where.startswith(("/", "\\", "~")) or ".." in PurePath(where).parts:
                raise RobotFileError(
                    f"{path.name}: <{tag[:40]}>: found {words[:80]!r}, a file elsewhere; accepted: "
                    "names of files beside it"
                )
