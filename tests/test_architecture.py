"""The rules of the house, see ARCHITECTURE.md: who imports what from where, and what a face
holds."""

import ast
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
TOP = ("cdpr_drake", "models", "systems", "analyses")

MOST_LINES = 610
"""A longer file holds more than one concept."""

MOST_POSITIONAL, MOST_ARGUMENTS = 6, 10

WITH_CODE = {
    "cdpr_drake",  # where kernels are kept is told before numba is imported
    "cdpr_drake.cli",  # as is what Ctrl-C does meanwhile
}
"""Packages whose `__init__` does more than say what the room is for and what is public."""


def module_name(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    name = ".".join(parts if parts[0] == "cdpr_drake" else ("cdpr_drake", *parts))
    return name.removesuffix(".__init__")


FILES = {module_name(path): path for top in TOP for path in (ROOT / top).rglob("*.py")}
ROOMS = {name for name, path in FILES.items() if path.name == "__init__.py"}
STUBS = {name for name in ROOMS if FILES[name].with_suffix(".pyi").exists()}


def is_kernel_or_command(function):
    """Compiled kernels take packed arrays one by one; a command's options are its arguments."""
    words = " ".join(ast.unparse(decorator) for decorator in function.decorator_list)
    return "njit" in words or "command" in words


def bound_names(body):
    """Names that statements of a module define, also below `if`, `try`, `with` and `for`."""
    found = set()
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Assign | ast.AnnAssign | ast.AugAssign | ast.For):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            for target in targets:
                found |= {n.id for n in ast.walk(target) if isinstance(n, ast.Name)}
        for part in ("body", "orelse", "finalbody"):
            if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                found |= bound_names(getattr(node, part, []))
    return found


@cache
def read(name):
    """What these tests ask of a file, without its syntax, which is large.

    Imports from this project as (module, name), wherever in the file they stand; functions that
    people call as (name, count of positional arguments, count of all); names that are defined;
    whether annotations are postponed, and whether fields of files are declared.
    """
    imports, functions = [], []
    tree = ast.parse(FILES[name].read_text())
    postponed = declares = False
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module == "__future__":
            postponed = postponed or any(alias.name == "annotations" for alias in node.names)
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
    fields = {what for module, what in imports if module == "cdpr_drake.schema.fields"}
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            for each in node.body:
                call = getattr(each, "value", None) if isinstance(each, ast.AnnAssign) else None
                declares = declares or (
                    isinstance(call, ast.Call) and getattr(call.func, "id", None) in fields
                )
    return imports, functions, bound_names(tree.body), postponed, declares


def test_names_are_imported_from_the_module_that_defines_them():
    """So each file says what it needs; a face is for those who use the package."""
    wrong = []
    for name in sorted(FILES):
        for module, what in read(name)[0]:
            if f"{module}.{what}" in FILES:
                continue  # a module as a whole
            if module not in FILES:
                wrong.append(f"{name}: there is no {module}")
            elif what not in read(module)[2]:
                wrong.append(f"{name}: {module} does not define {what}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("name", sorted(ROOMS))
def test_every_room_says_what_it_is_for(name):
    tree = ast.parse(FILES[name].read_text())
    assert len((ast.get_docstring(tree) or "").strip()) > 40
    if name not in WITH_CODE:  # nothing but the lazy face
        allowed = ("import lazy_loader", "__getattr__, __dir__, __all__ = lazy_loader.attach_stub")
        assert all(ast.unparse(node).startswith(allowed) for node in tree.body[1:])
        assert (len(tree.body) > 1) == (name in STUBS)


@pytest.mark.parametrize("name", sorted(STUBS))
def test_a_face_holds_what_its_stub_says(name):
    """The stub is what editors and mypy read, and what the face imports when it is asked."""
    module = import_module(name)
    stub = ast.parse(FILES[name].with_suffix(".pyi").read_text())
    told = {alias.name for node in stub.body for alias in node.names}
    assert all(alias.asname == alias.name for node in stub.body for alias in node.names)
    assert set(module.__all__) == told
    for node in stub.body:
        home = import_module(f"{name}.{node.module}")
        assert all(getattr(module, a.name) is getattr(home, a.name) for a in node.names)
        assert {a.name for a in node.names} <= read(home.__name__)[2]


@pytest.mark.parametrize("name", sorted(STUBS))
def test_no_public_name_is_a_module_of_its_room(name):
    """`from room import name` would give the function, or the module, as imports went before."""
    folder = FILES[name].parent
    beside = {path.stem for path in folder.glob("*.py")} | {path.name for path in folder.iterdir()}
    assert not set(import_module(name).__all__) & beside


def test_no_study_is_known_but_to_the_catalogue():
    """And what is above it; the catalogue knows all, so that a study that knew it, or what is
    above it, would make a circle."""
    room = "cdpr_drake.analyses.studies."
    wrong = []
    for name in sorted(FILES):
        for module, _ in read(name)[0]:
            study = module.removeprefix(room).partition(".")[0] if module.startswith(room) else ""
            shared = study in ("", "catalogue", "framework", "published")
            own = f"{name}.".startswith(f"{room}{study}.")
            if not shared and not own and name != f"{room}catalogue":
                wrong.append(f"{name} imports from {module}")
    assert not wrong, "\n".join(wrong)


def test_files_have_no_circles():
    """Imports under TYPE_CHECKING and inside functions count; the sorter raises CycleError."""
    graph = {}
    for name in FILES:
        needs = set()
        for module, what in read(name)[0]:
            needs.add(f"{module}.{what}" if f"{module}.{what}" in FILES else module)
        graph[name] = needs - {name}
    assert len(list(TopologicalSorter(graph).static_order())) == len(FILES)


def test_no_file_is_too_long():
    lines = {name: len(path.read_text().splitlines()) for name, path in FILES.items()}
    assert not {name: n for name, n in lines.items() if n > MOST_LINES}


def test_modules_that_declare_fields_of_files_have_no_postponed_annotations():
    """Drake's YAML loader reads annotations as types; text in their place breaks every file."""
    schema = {name for name in FILES if read(name)[4]}
    assert len(schema) > 20
    assert not {name for name in schema if read(name)[3]}


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
