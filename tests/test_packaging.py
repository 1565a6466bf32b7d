"""The wheel's packages, the import rules and the README agree with what is on disk."""

import re
import subprocess
import sys
import tomllib
import zipfile
from itertools import chain
from pathlib import Path
from typing import TypeVar, get_args, get_overloads, get_type_hints

import yaml
from setuptools import find_packages

import cdpr_drake as cdpr
from cdpr_drake.systems.diagrams.load import SCENARIO_SCHEMAS
from cdpr_drake.version import __version__
from tests.lowest import LISTED, REQUIREMENT, lowest

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
TOP = ("cdpr_drake", "models", "systems", "analyses")
ENDINGS = ("yaml", "tsv", "css", "js")

MOST_CHANGES = 340
"""Lines of a changelog that people read; the rest is in the history."""


def python_folders():
    """Folders that hold Python files, as packages."""
    found = set()
    for top in TOP:
        for path in (ROOT / top).rglob("*.py"):
            parts = path.parent.relative_to(ROOT).parts
            found.add(".".join(parts if top == "cdpr_drake" else ("cdpr_drake", *parts)))
    return found


def test_packages_are_the_folders_on_disk():
    find = PROJECT["tool"]["setuptools"]["packages"]["find"]
    assert set(find_packages(str(ROOT), include=find["include"])) == python_folders()


def test_every_python_folder_says_what_it_is_for():
    for top in (*TOP, "tests", "cdpr_drake/cli"):
        first = (ROOT / top / "__init__.py").read_text()
        assert first.startswith('"""')


def test_an_editable_install_is_a_path_that_type_checkers_follow(tmp_path):
    """By an import hook, as flat layouts are installed otherwise, mypy and editors see no types."""
    build = f"from setuptools import build_meta; build_meta.build_editable({str(tmp_path)!r})"
    subprocess.run([sys.executable, "-c", build], cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as held:
        (link,) = (name for name in held.namelist() if name.endswith(".pth"))
        assert not [name for name in held.namelist() if name.endswith(".py")]
        assert Path(held.read(link).decode().strip()) == ROOT
    assert (ROOT / "cdpr_drake" / "py.typed").is_file()


def test_verbs_that_give_several_kinds_say_which():
    """Without an overload, editors and mypy would take what they give for anything."""
    own, all_kinds = (get_type_hints(each)["return"] for each in get_overloads(cdpr.load_scenario))
    assert isinstance(own, TypeVar)
    assert set(get_args(all_kinds)) == {schema for schema, _ in SCENARIO_SCHEMAS.values()}


def test_links_serve_editors():
    for name in ("models", "systems", "analyses", "notebooks"):
        link = ROOT / "cdpr_drake" / name
        assert link.is_symlink()
        assert link.resolve() == ROOT / name


def test_every_file_is_in_a_layer():
    listed = {
        name.strip()
        for contract in PROJECT["tool"]["importlinter"]["contracts"]
        for layer in contract["layers"]
        for name in layer.split("|")
    }
    for top in TOP:
        for path in (ROOT / top).rglob("*.py"):
            parts = path.relative_to(ROOT).with_suffix("").parts
            parts = parts if top == "cdpr_drake" else ("cdpr_drake", *parts)
            if parts[-1].startswith("__"):  # faces, and what starts the command
                continue
            above = {".".join(parts[:count]) for count in range(2, len(parts) + 1)}
            is_study = parts[:3] == ("cdpr_drake", "analyses", "studies") and len(parts) > 3
            assert above & listed or is_study, path  # studies: see test_architecture


def test_data_files_are_packaged():
    data = PROJECT["tool"]["setuptools"]["package-data"]
    packaged = set()
    for package, patterns in data.items():
        parts = package.split(".")
        folder = ROOT.joinpath(*parts[1:]) if len(parts) > 1 else ROOT / parts[0]
        packaged |= {path for pattern in patterns for path in folder.glob(pattern)}
    for top in ("models", "systems", "analyses"):
        found = {path for ending in ENDINGS for path in (ROOT / top).rglob(f"*.{ending}")}
        assert found <= packaged
    notebooks = {path.resolve() for path in packaged if path.suffix == ".ipynb"}
    assert notebooks == set((ROOT / "notebooks").glob("*.ipynb"))


def test_readme_examples_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    readme = (ROOT / "README.md").read_text()
    examples = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)
    assert len(examples) >= 2
    for example in examples:
        assert len(example.strip().splitlines()) <= 17
        exec(compile(example, "README.md", "exec"), {})


def test_readme_has_exactly_two_commands_for_a_fresh_machine():
    readme = (ROOT / "README.md").read_text()
    commands = [line for line in readme.splitlines() if line.startswith("python3 -m venv")]
    assert len(commands) == 2
    assert commands[0].endswith("cdpr simulate")
    assert commands[1].endswith("pytest -n auto")


def test_the_citation_and_the_changelog_are_of_this_version():
    """Every key that CFF 1.2.0 demands, and the newest heading with a version."""
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= set(citation)
    assert citation["version"] == __version__
    assert citation["license"] == PROJECT["project"]["license"]
    assert citation["keywords"] == PROJECT["project"]["keywords"]
    assert citation["authors"] == PROJECT["project"]["authors"]
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    newest, second = re.findall(r"^## (.*)$", changes, re.MULTILINE)[:2]
    assert newest == "[Unreleased]"
    assert second == f"[{__version__}] - {citation['date-released']}"


def test_the_changelog_has_the_groups_of_its_form_and_is_short():
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    groups = ("Added", "Changed", "Deprecated", "Removed", "Fixed", "Security")
    for part in re.split(r"^## ", changes, flags=re.MULTILINE)[1:]:
        found = re.findall(r"^### (.*)$", part, re.MULTILINE)
        assert found == [group for group in groups if group in found], part.splitlines()[0]
    assert len(changes.splitlines()) <= MOST_CHANGES


def test_the_lowest_versions_are_those_of_the_project():
    assert LISTED.read_text(encoding="utf-8") == lowest()


def test_every_dependency_has_one_lower_bound():
    extras = PROJECT["project"]["optional-dependencies"]
    bounds = {}
    for requirement in chain(PROJECT["project"]["dependencies"], *extras.values()):
        found = REQUIREMENT.fullmatch(requirement)
        assert found["lower"], requirement
        assert bounds.setdefault(found["name"], found["lower"]) == found["lower"], requirement


def test_the_hook_refuses_long_subjects(tmp_path):
    message = tmp_path / "message"
    for length, code in ((72, 0), (73, 1)):
        message.write_text("s" * length + "\n\n" + "body " * 100)
        done = subprocess.run([ROOT / ".ci" / "commit-msg", message], capture_output=True)
        assert done.returncode == code
