"""Follows a recipe: copies its new files, adds its rows to tables.

`templates/NAME` holds the files of a recipe where they would stand in the project. A file that ends
in `.rows` is about the file of the same name: its imports and the rows of its tables join there.
"""

from __future__ import annotations

import ast
import os
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
TEMPLATES = Path(__file__).parent / "templates"
CODE = ("cdpr_drake", "models", "systems", "analyses")
LINKS = CODE[1:]

RECIPES = {
    "tension_method": "A tension method",
    "cable_model": "A cable model",
    "estimator": "An estimator",
    "scheme": "A scheme of visual servoing",
    "target": "A target",
    "sensor": "A sensor",
    "run_subject": "A subject of a run",
    "study": "A study",
    "subcommand": "A subcommand",
}
"""Folders of templates, each with the heading of its recipe."""


def files_of(recipe: str) -> list[str]:
    """Files that a recipe makes or changes, from the project's folder."""
    folder = TEMPLATES / recipe
    found = [p.relative_to(folder) for p in folder.rglob("*") if p.suffix in (".py", ".rows")]
    return sorted(path.as_posix().removesuffix(".rows") for path in found)


def steps_of(recipe: str) -> str:
    """The words of a recipe in CONTRIBUTING.md."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    return re.split(r"^## ", text.split(f"\n## {RECIPES[recipe]}\n")[1], flags=re.MULTILINE)[0]


def mirror(copy: Path) -> None:
    """A copy of the sources: folders of its own, files as links."""
    for top in CODE:
        for folder, below, names in os.walk(ROOT / top):
            below[:] = [name for name in below if name != "__pycache__"]
            here = copy / Path(folder).relative_to(ROOT)
            here.mkdir(parents=True)
            for name in names:
                (here / name).symlink_to(Path(folder) / name)
    for name in LINKS:
        (copy / "cdpr_drake" / name).symlink_to(Path("..") / name)
    (copy / "tests").mkdir()
    (copy / "pyproject.toml").symlink_to(ROOT / "pyproject.toml")


def follow(recipe: str, copy: Path) -> list[Path]:
    """Adds to a copy what a recipe says; the tests that came with it."""
    tests = []
    for name in files_of(recipe):
        template, target = TEMPLATES / recipe / name, copy / name
        rows = template.with_name(f"{template.name}.rows")
        if rows.exists():
            text = with_rows(target.read_text(encoding="utf-8"), rows.read_text(encoding="utf-8"))
            target.unlink()  # the link
        else:
            text = template.read_text(encoding="utf-8")
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, encoding="utf-8")
        if name.startswith("tests/"):
            tests.append(target)
    return tests


def with_rows(text: str, rows: str) -> str:
    """A module with the imports and the rows of tables that another text has."""
    lines = text.splitlines()
    tree, added = ast.parse(text), ast.parse(rows)
    imports = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    inserted = []
    for node in added.body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            inserted.append((imports[-1].end_lineno, ast.unparse(node)))
            continue
        assert isinstance(node, ast.Assign | ast.AnnAssign)
        row = ast.unparse(node.value)[1:-1].rstrip(",")
        inserted.append((_end_of(tree, _name(node), lines), f"    {row},"))
    for number, line in sorted(inserted, key=lambda each: -(each[0] or 0)):
        lines.insert(number or 0, line)
    return "\n".join(lines) + "\n"


def _name(node: ast.Assign | ast.AnnAssign) -> str:
    target = node.targets[0] if isinstance(node, ast.Assign) else node.target
    return ast.unparse(target)


def _end_of(tree: ast.Module, name: str, lines: list[str]) -> int:
    """The line before the bracket that closes a table, or the names that a table is made from."""
    for node in tree.body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and _name(node) == name:
            table = node.value
            if isinstance(table, ast.DictComp):
                table = table.generators[0].iter
            end = table.end_lineno if table is not None else None
            assert end is not None
            assert lines[end - 1].lstrip()[0] in ")}", "the bracket has a line of its own"
            return end - 1
    raise AssertionError(f"there is no table {name}")
