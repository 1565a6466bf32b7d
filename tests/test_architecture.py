"""Rooms are imported by their faces, files have no circles, and nothing grows beyond its size."""

import ast
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from importlib import import_module
from pathlib import Path
from statistics import median

import pytest

ROOT = Path(__file__).parent.parent
TOP = ("cdpr_drake", "models", "systems", "analyses")

PLAIN = {"cdpr_drake", "cdpr_drake.cli", "cdpr_drake.analyses", "cdpr_drake.analyses.studies"}
"""Packages without a face: their modules are imported by their own names."""

SUBROOMS = {"cdpr_drake.stability", "cdpr_drake.workspaces"}
"""Rooms of rooms with one face for all outside; inside, each of their rooms has its own."""

LISTS = {"cdpr_drake.cli"}
"""Lists of like things, which may be longer than a room."""

MOST_MODULES, MOST_LINES, MEDIAN_LINES = 14, 400, 150
MOST_POSITIONAL, MOST_ARGUMENTS = 6, 10


def module_name(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    name = ".".join(parts if parts[0] == "cdpr_drake" else ("cdpr_drake", *parts))
    return name.removesuffix(".__init__")


FILES = {module_name(path): path for top in TOP for path in (ROOT / top).rglob("*.py")}
ROOMS = {name for name, path in FILES.items() if path.name == "__init__.py"}


def room(name):
    return name if name in ROOMS else name.rsplit(".", 1)[0]


def is_kernel_or_command(function):
    """Compiled kernels take packed arrays one by one; a command's options are its arguments."""
    words = " ".join(ast.unparse(decorator) for decorator in function.decorator_list)
    return "njit" in words or "command" in words


@cache
def read(name):
    """What these tests ask of a file, without its syntax, which is large: imports, functions.

    Imports from this project as (module, name), wherever in the file they stand; and functions
    that people call as (name, count of positional arguments, count of all).
    """
    imports, functions = [], []
    for node in ast.walk(ast.parse(FILES[name].read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("cdpr_drake"):
            imports += [(node.module, alias.name) for alias in node.names]
        if isinstance(node, ast.FunctionDef) and not is_kernel_or_command(node):
            if name.endswith("_kernel") or (
                name.startswith("cdpr_drake.cli.") and node.args.defaults
            ):
                continue
            positional = [a for a in node.args.args + node.args.posonlyargs if a.arg != "self"]
            everything = len(positional) + len(node.args.kwonlyargs)
            functions.append((node.name, len(positional), everything))
    return imports, functions


def face(target, here):
    """What a file of the room `here` must name to import from the room `target`."""
    for outer in SUBROOMS:
        inside = here == outer or here.startswith(f"{outer}.")
        if (target == outer or target.startswith(f"{outer}.")) and not inside:
            return outer
    return target


def test_rooms_are_imported_by_their_faces():
    wrong = []
    for name in sorted(FILES):
        here = room(name)
        for module, what in read(name)[0]:
            if f"{module}.{what}" in FILES and room(module) not in {here, *PLAIN}:
                wrong.append(f"{name}: {module}.{what} is a module of another room")
            target = room(module)
            if target != here and target not in PLAIN:
                if name in ROOMS and target.startswith(f"{name}."):
                    continue  # a face of rooms
                if module != face(target, here):
                    wrong.append(f"{name}: {module}.{what}: import it from the face")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("name", sorted(ROOMS - PLAIN))
def test_every_room_has_a_face(name):
    module = import_module(name)
    assert module.__doc__
    assert len(module.__doc__.strip()) > 40
    assert module.__all__
    for exported in module.__all__:
        assert hasattr(module, exported), exported


def test_files_have_no_circles():
    """Imports under TYPE_CHECKING and inside functions count; the sorter raises CycleError."""
    graph = {}
    for name in FILES:
        needs = set()
        for module, what in read(name)[0]:
            needs.add(f"{module}.{what}" if f"{module}.{what}" in FILES else module)
        graph[name] = needs - {name}
    assert len(list(TopologicalSorter(graph).static_order())) == len(FILES)


def test_rooms_and_modules_keep_their_size():
    modules = {}
    for name, path in FILES.items():
        if path.name != "__init__.py":
            modules.setdefault(room(name), []).append(name)
    crowded = {r: len(m) for r, m in modules.items() if len(m) > MOST_MODULES and r not in LISTS}
    assert not crowded
    lines = {name: len(path.read_text().splitlines()) for name, path in FILES.items()}
    assert not {name: n for name, n in lines.items() if n > MOST_LINES}
    assert median(lines.values()) <= MEDIAN_LINES


def test_calls_stay_readable():
    wrong = [
        f"{name}: {function} has {positional} positional of {everything} arguments"
        for name in sorted(FILES)
        for function, positional, everything in read(name)[1]
        if positional > MOST_POSITIONAL or everything > MOST_ARGUMENTS
    ]
    assert not wrong, "\n".join(wrong)


def test_the_package_alone_is_light():
    words = "import sys, cdpr_drake; print(any(m in sys.modules for m in ('numba', 'pydrake')))"
    done = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
