"""The rules of the house, see ARCHITECTURE.md: who imports what from where, and what a face
holds."""

import ast
import subprocess
import sys
import tomllib
from functools import cache
from graphlib import TopologicalSorter
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import pytest

from cdpr_drake.systems.sections import SECTIONS

ROOT = Path(__file__).parent.parent
TOP = ("cdpr_drake", "models", "systems", "analyses")

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


class Module(NamedTuple):
    """What these tests ask of a file, without its syntax, which is large."""

    imports: list[tuple[str, str]]
    """From this project as (module, name), wherever in the file they stand."""
    typed: set[tuple[str, str]]
    """Those of them that stand under TYPE_CHECKING."""
    defined: set[str]
    """Names."""
    postponed: bool
    """Whether its annotations are text."""
    declares: bool
    """Whether it declares settings."""
    readers: set[str]
    """Names of READERS that it calls or hands on."""


@cache
def read(name):
    tree = ast.parse(FILES[name].read_text(encoding="utf-8"))
    nodes = list(ast.walk(tree))
    origins = [(node.module or "", alias.name) for node in nodes
               if isinstance(node, ast.ImportFrom) for alias in node.names]  # fmt: skip
    imports = [(module, what) for module, what in origins if module.startswith("cdpr_drake")]
    guards = [node for node in nodes if isinstance(node, ast.If)]
    checked = [node for node in guards if ast.unparse(node.test) == "TYPE_CHECKING"]
    typed = {(node.module or "", alias.name) for part in checked for node in ast.walk(part)
             if isinstance(node, ast.ImportFrom) for alias in node.names}  # fmt: skip
    named = {f"{module}.{what}" for module, what in origins}
    for node in nodes:
        if isinstance(node, ast.Attribute):
            base = node.value.id if isinstance(node.value, ast.Name) else ""
            named |= {f"{base}.{node.attr}", node.attr}
        elif isinstance(node, ast.Name):
            named.add(node.id)
    return Module(
        imports,
        typed,
        bound_names(tree.body),
        ("__future__", "annotations") in origins,
        ("cdpr_drake.schema.declarations", "settings") in imports,
        {SAME_READER.get(one, one) for one in named} & set(READERS),
    )  # fmt: skip


def test_names_are_imported_from_the_module_that_defines_them():
    """So each file says what it needs; a face is for those who use the package."""
    wrong = []
    for name in sorted(FILES):
        for module, what in read(name).imports:
            if f"{module}.{what}" in FILES:
                continue  # a module as a whole
            if module not in FILES:
                wrong.append(f"{name}: there is no {module}")
            elif what not in read(module).defined:
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
        assert {a.name for a in node.names} <= read(home.__name__).defined


@pytest.mark.parametrize("name", sorted(STUBS))
def test_no_public_name_is_a_module_of_its_room(name):
    """`from room import name` would give the function, or the module, as imports went before."""
    folder = FILES[name].parent
    beside = {path.stem for path in folder.glob("*.py")} | {path.name for path in folder.iterdir()}
    assert not set(import_module(name).__all__) & beside


def test_files_have_no_circles():
    """Imports inside functions count, those for types alone do not: a result draws itself by
    functions that take it. The sorter raises CycleError."""
    graph = {}
    for name in FILES:
        needs = set()
        for module, what in read(name).imports:
            if (module, what) not in read(name).typed:
                needs.add(f"{module}.{what}" if f"{module}.{what}" in FILES else module)
        graph[name] = needs - {name}
    assert len(list(TopologicalSorter(graph).static_order())) == len(FILES)


CORE_WITH_SCENARIOS = ("cdpr_drake.systems", "cdpr_drake.analyses.runs")
"""Where scenarios are read, wired and run: what would name a section if it were not a plug-in."""

TABLES = {"cdpr_drake.systems.sections", "cdpr_drake.cli.commands"}
"""What lists sections and their verbs, as strings."""


HOLDERS = {"visual_servo": ("scenario", "settings", "whole"), "sensors": ("sensors", "suite")}
"""What settings with sections are called, by the sections' place; else as the place."""


def names_of_sections(path, keys):
    """What of a file names a section: settings' attributes, and strings that begin with a key.

    `keys` has what such settings are called, by the sections' keys.
    """
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Attribute) and node.attr in keys:
            base = ast.unparse(node.value).rpartition(".")[2]
            if base in keys[node.attr]:
                yield f"line {node.lineno}: {ast.unparse(node)}"
        elif isinstance(node, ast.Call) and ast.unparse(node.func) == "getattr":
            if isinstance(node.args[1], ast.Constant) and node.args[1].value in keys:
                yield f"line {node.lineno}: {ast.unparse(node)}"
        elif isinstance(node, ast.Yield) and isinstance(node.value, ast.Tuple):
            key = node.value.elts[0]
            if isinstance(key, ast.Constant) and str(key.value).split(".")[0] in keys:
                yield f"line {node.lineno}: {ast.unparse(node)}"


def test_the_core_names_no_section():
    """A section of a scenario hangs on by its row; no other file knows it."""
    keys = {}
    for name in SECTIONS:
        place, _, key = name.rpartition(".")
        keys[key] = (*keys.get(key, ()), *HOLDERS.get(place, (place,)))
    named = []
    for name, path in FILES.items():
        if name.startswith("cdpr_drake.sections") or name in TABLES:
            continue
        wing = name.startswith(("cdpr_drake.analyses.studies", "cdpr_drake.studio"))
        if not wing:
            named += [f"{name}: {module}" for module, _ in read(name).imports
                      if module.startswith("cdpr_drake.sections")]  # fmt: skip
        if name.startswith(CORE_WITH_SCENARIOS):
            named += [f"{name}: {words}" for words in names_of_sections(path, keys)]
    assert not named, "\n".join(named)


@pytest.mark.parametrize("words", [
    "if scenario.stability: pass", "getattr(scenario, 'stability', None)",
    "def f():\n    yield 'stability.threshold', 1, 2",
])  # fmt: skip
def test_a_file_that_names_a_section_is_found(tmp_path, words):
    path = tmp_path / "core.py"
    path.write_text(words)
    assert list(names_of_sections(path, {"stability": HOLDERS["visual_servo"]}))


def test_modules_that_declare_settings_have_no_postponed_annotations():
    """`help` has what they say, and words of a module would be looked up in that of its user."""
    schema = {name for name in FILES if read(name).declares}
    assert len(schema) > 20
    assert not {name for name in schema if read(name).postponed}


READERS = {
    "yaml.load": {"cdpr_drake.schema.yaml_files"},
    "yaml_load_typed": set(),  # Drake's does not see through Annotated
    "LoadIrisRegionsYamlFile": {"cdpr_drake.proofs.proven_sets"},  # what Drake wrote for it
    "json.loads": {"cdpr_drake.schema.json_text"},
    "AddModels": {"cdpr_drake.models.drake_parsing"},
}
"""What reads text of others, and the only modules that may call it."""

OTHER_READERS = {
    "yaml.load": [
        *("safe_load", "full_load", "unsafe_load", "load_all", "safe_load_all", "compose"),
        *("compose_all", "parse", "scan", "SafeLoader", "CSafeLoader", "Loader", "FullLoader"),
        "cyaml.CParser",
    ],
    "json.loads": ["load", "JSONDecoder", "decoder"],
    "yaml_load_typed": ["yaml_load", "yaml_load_data", "yaml_load_file"],
    "AddModels": [
        *("AddModelsFromString", "AddModelsFromUrl", "AddModelFromFile", "LoadModelDirectives"),
        *("LoadModelDirectivesFromString", "ProcessModelDirectives"),
    ],
}
"""What is meant with them; of a module, where they are of one."""

SAME_READER = {
    f"{reader.partition('.')[0]}.{name}" if "." in reader else name: reader
    for reader, names in OTHER_READERS.items()
    for name in names
}


def test_yaml_json_and_models_are_read_at_one_place_each():
    """There a damaged or hostile text is refused by one kind of error, before it grows."""
    found = {(name, reader) for name in FILES for reader in read(name).readers}
    assert not {(name, reader) for name, reader in found if name not in READERS[reader]}
    assert {reader for _, reader in found} == {name for name, places in READERS.items() if places}


def test_the_package_alone_is_light():
    words = "import sys, cdpr_drake; print(any(m in sys.modules for m in ('numba', 'pydrake')))"
    done = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


WITHOUT_WINGS = """
import sys
from importlib import import_module

class NoWing:
    def find_spec(self, name, path=None, target=None):
        if any(f"{name}.".startswith(f"{wing}.") for wing in WINGS):
            raise ModuleNotFoundError(f"{name} is a wing")

WINGS, core = eval(sys.stdin.read())
sys.meta_path.insert(0, NoWing())
for name in core:
    import_module(name)
"""


def test_the_core_is_imported_without_any_wing():
    """import-linter holds it, too, but does not see modules that are named by strings."""
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    wings = [package for wing in tools["rooms"]["wings"].values() for package in wing]
    core = [
        name for name in sorted(FILES)
        if not any(f"{name}.".startswith(f"{wing}.") for wing in wings)
        and name != "cdpr_drake.__main__"
    ]  # fmt: skip
    assert len(core) > 500
    words = [sys.executable, "-c", WITHOUT_WINGS]
    subprocess.run(words, input=repr((wings, core)), text=True, check=True)
