"""The door to Drake's parsers: files of bodies and meshes, of which nothing may end this process.

What Drake refuses becomes an error of one line. Some files end the process that reads them by a
fault in a library, such as one that includes itself, or a glTF with fewer bytes than it says;
others never end. So the files of users are read in a process of its own first.
"""

from __future__ import annotations

import json
import logging
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from pydrake.multibody.parsing import Parser
from pydrake.multibody.tree import ModelInstanceIndex

from cdpr_drake.errors import CdprError, RobotFileError
from cdpr_drake.schema.input_files import input_bytes, input_there

LONGEST_PARSING = 60
"""Time of a processor after which a file counts as one that is never read to its end [s]."""

MOST_MEMORY = 8 * 2**30
"""What reading a file may take [byte]."""

_OWN = Path(__file__).resolve().parent
"""Files below are those of the package, which were read before."""

_PROGRAM = """
import json, os, resource, sys
seconds, memory, asked = json.loads(sys.argv[1])
for which, limit in ((resource.RLIMIT_CPU, seconds), (resource.RLIMIT_AS, memory),
                     (resource.RLIMIT_CORE, 0)):
    _, hard = resource.getrlimit(which)
    if hard != resource.RLIM_INFINITY:
        limit = min(limit, hard)
    resource.setrlimit(which, (limit, hard))
from pydrake.geometry import Mesh, SceneGraph
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
try:
    if "mesh" in asked:
        Mesh(asked["mesh"], 1.0).GetConvexHull()
    else:
        scene_graph, plant = SceneGraph(), MultibodyPlant(0.0)
        plant.RegisterAsSourceForSceneGraph(scene_graph)
        parser = Parser(plant)
        parser.SetAutoRenaming(True)
        for package, folder in asked["packages"].items():
            if not parser.package_map().Contains(package):
                parser.package_map().Add(package, folder)
        if asked["text"] is None:
            parser.AddModels(asked["file"])
        else:
            parser.AddModelsFromString(asked["text"], asked["kind"])
        plant.Finalize()
        inspector = scene_graph.model_inspector()
        for geometry in inspector.GetAllGeometryIds():
            shape = inspector.GetShape(geometry)
            if isinstance(shape, Mesh):
                shape.GetConvexHull()
except BaseException as problem:
    if "mesh" in asked:
        os.write(1, str(problem).encode())
        os._exit(3)
os._exit(0)
"""
"""Reads a file as this module does; what is refused of a model is refused here again, with words.
Of a mesh it says the words itself: VTK writes others on stderr."""

_read: set[str] = set()
"""What was read to its end before, by what was asked and the state of the file."""


def drake_line(problem: BaseException) -> str:
    """What Drake says, in one line of at most 300 characters."""
    words = " ".join(str(problem).split()) or type(problem).__name__
    return words if len(words) <= 300 else words[:297] + "..."


@contextmanager
def drake_refusals(words: str, error: type[CdprError] = RobotFileError) -> Iterator[None]:
    """Raises what Drake refuses as one line behind these words.

    An assertion of Drake arrives in Python as a SystemExit with words. What Drake logs meanwhile is
    left out, since what matters comes as an exception.
    """
    log = logging.getLogger("drake")
    level = log.level
    log.setLevel(logging.CRITICAL + 1)
    try:
        yield
    except SystemExit as problem:
        if not isinstance(problem.code, str):
            raise
        raise error(f"{words}: {drake_line(problem)}") from problem
    except (ArithmeticError, IndexError, MemoryError, OSError, RuntimeError,
            ValueError) as problem:  # fmt: skip
        raise error(f"{words}: {drake_line(problem)}") from problem
    finally:
        log.setLevel(level)


def parse_models(
    parser: Parser,
    file: Path,
    text: str | None = None,
    kind: str = "",
    packages: Mapping[str, str] | None = None,
) -> list[ModelInstanceIndex]:
    """Adds the models of a file to a parser's plant; to be called within `drake_refusals`.

    Args:
        parser: The parser.
        file: URDF, SDFormat, MJCF or model directives.
        text: What stands in the file, where that is not taken as it is; None: it is.
        kind: Ending of a text, as Drake's parser names it.
        packages: Folders of packages by name, added to the parser's.

    Raises:
        RuntimeError: Drake refuses it, or the file ends or holds up a process that reads it.
    """
    known = dict(packages or {})
    try_first(file, {"file": str(file.absolute()), "text": text, "kind": kind, "packages": known})
    for package, folder in known.items():
        if not parser.package_map().Contains(package):
            parser.package_map().Add(package, folder)
    if text is None:
        return list(parser.AddModels(str(file.absolute())))
    return list(parser.AddModelsFromString(text, kind))


_NAMED = re.compile(
    r"""(?:filename|file|uri)\s*=\s*["']([^"']+)|<uri>\s*([^<]+?)\s*</uri>"""
    r"""|\b(?:file|uri)["']?\s*:\s*["']?([^"'\s,}\]]+)|^\s*(?:mtllib|map_\w+)\s+(\S+)""",
    re.MULTILINE,
)
"""Names of files in URDF, SDFormat, model directives, glTF and OBJ."""

_PACKAGE = "package.xml"


def named_files(file: Path, packages: Mapping[str, str] | None = None) -> list[Path]:
    """Files that a model names, and what these name in turn.

    By a path from its own folder, or by package:// of the given packages, or of one above it. What
    file:// names is not among them: Drake reads that where it is.
    """
    found: dict[Path, None] = {}
    waiting = [file]
    while waiting:
        one = waiting.pop()
        content = input_bytes(one)
        if b"\0" in content:  # a picture or a mesh of bytes names none
            continue
        for match in _NAMED.finditer(content.decode("utf-8", "replace")):
            named = next(filter(None, match.groups()))
            for place in _places(named, one.parent, packages or {}):
                other = Path(os.path.normpath(place))
                if other not in found and other != file and input_there(other):
                    found[other] = None
                    waiting.append(other)
    return list(found)


def _places(named: str, folder: Path, packages: Mapping[str, str]) -> list[Path]:
    """Where a file lies that is named in a folder, with what makes its package one."""
    scheme, is_uri, rest = named.partition("://")
    if not is_uri:
        return [folder / named]
    name, _, inside = rest.partition("/")
    if scheme not in ("package", "model"):
        return []
    above = [Path(packages[name])] if name in packages else [
        parent for parent in folder.absolute().parents if package_name(parent / _PACKAGE) == name
    ]  # fmt: skip
    if package_name(folder / _PACKAGE) == name:
        above.insert(0, folder)
    return [above[0] / inside, above[0] / _PACKAGE] if above else []


def package_name(manifest: Path) -> str | None:
    """The name in the manifest of a package; None: there is no such file, or no name in it."""
    if not input_there(manifest):
        return None
    content = input_bytes(manifest).decode("utf-8", "replace")
    found = re.search(r"<name>\s*([^<]*?)\s*</name>", content)
    return None if found is None else found[1]


def try_mesh(file: Path) -> None:
    """Reads a mesh in another process; to be called within `drake_refusals`.

    Raises:
        RuntimeError: Drake refuses it, or it ends or holds up a process that reads it.
    """
    try_first(file, {"mesh": str(file.absolute())})


def try_first(file: Path, asked: Mapping[str, object]) -> None:
    """Reads a file in another process, once for each of its states.

    Raises:
        RuntimeError: That process was ended by the file, or did not end.
        OSError: The file is not there.
    """
    path = file.resolve()
    if path.is_relative_to(_OWN):
        return
    state = path.stat()
    key = json.dumps([asked, state.st_mtime_ns, state.st_size, state.st_ino], sort_keys=True)
    if key in _read:
        return
    words = json.dumps([LONGEST_PARSING, MOST_MEMORY, asked])
    done = subprocess.run(
        [sys.executable, "-P", "-c", _PROGRAM, words],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        check=False,
    )
    if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        raise RuntimeError(
            f"Drake's parser has not read it after {LONGEST_PARSING} s, as where a file includes "
            "itself"
        )
    if done.returncode < 0:
        how = signal.Signals(-done.returncode).name
        raise RuntimeError(
            f"Drake's parser ends by {how}, as where a file includes itself or has fewer bytes "
            "than it says"
        )
    if done.returncode == 3:
        raise RuntimeError(done.stdout.decode("utf-8", "replace"))
    if done.returncode == 0:
        _read.add(key)
