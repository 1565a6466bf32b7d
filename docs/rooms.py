"""Draws the rooms in their layers, and lists them in ARCHITECTURE.md: both from the code.

    python -m docs.rooms          writes docs/images/rooms.svg and the list
    python -m docs.rooms --check  exit code 1 where one of them is not what the code says

A layer imports only from layers below it, as import-linter's contract in pyproject.toml says. Its
first rows are the wings, by `tool.rooms.wings` there; the rows below them are the core. Numbers of
lines in the list may be off by `TOLERANCE` before they count as old.
"""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Iterable
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PICTURE = ROOT / "docs" / "images" / "rooms.svg"
PAGE = ROOT / "ARCHITECTURE.md"
BEGIN, END = "<!-- rooms: python -m docs.rooms -->\n", "<!-- end of rooms -->\n"

FOLDERS = {
    "cdpr_drake.cli": ("cdpr_drake/cli", "#ffffff"),
    "cdpr_drake.studio": ("cdpr_drake/studio", "#f2f2f2"),
    "cdpr_drake.analyses": ("analyses", "#d9e8f5"),
    "cdpr_drake.systems": ("systems", "#f7e3c6"),
    "cdpr_drake.models": ("models", "#d8ecd8"),
}
"""Folders by their packages, each with the colour of its boxes; what is left is the library."""

LIBRARY = ("cdpr_drake", "#ffffff")

TOLERANCE = 0.05
"""Of numbers of lines, as a share; those up to two thousand lines may be off by a hundred."""

WIDTH, LEFT, HEIGHT, GAP, LETTER = 640, 130, 26, 6, 6.9


@cache
def tools() -> dict[str, Any]:
    """The tables of tools in pyproject.toml."""
    tables: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]
    return tables


def layers() -> list[list[str]]:
    """Modules and packages from the top layer down, siblings side by side."""
    contract = tools()["importlinter"]["contracts"][0]
    return [[name.strip() for name in layer.split("|")] for layer in contract["layers"]]


def wing_of(module: str) -> str:
    """The wing that a module belongs to, an empty text for the core."""
    for wing, packages in tools()["rooms"]["wings"].items():
        if any(f"{module}.".startswith(f"{package}.") for package in packages):
            return str(wing)
    return ""


def check_order() -> None:
    """Wings stand above the core, so that the contract of layers keeps the core from them.

    Raises:
        SystemExit: A row of the core stands above one of a wing.
    """
    rows = [bool(wing_of(module)) for layer in layers() for module in layer]
    if rows != sorted(rows, reverse=True):
        raise SystemExit("pyproject.toml: layers: found a wing below the core; accepted: above it")


def lines_of(module: str) -> int:
    """Lines of a module, or of all files of a package."""
    path = path_of(module)
    files = path.parent.rglob("*.py*") if path.name == "__init__.py" else [path]
    sources = [file for file in files if file.suffix in (".py", ".pyi")]
    return sum(len(file.read_text(encoding="utf-8").splitlines()) for file in sources)


def thousands(modules: Iterable[str]) -> str:
    """Lines of modules and packages, as 1.2k."""
    return f"{sum(map(lines_of, modules)) / 1000.0:.1f}k"


def folder_of(module: str) -> tuple[str, str]:
    """The folder that a package's box belongs to, and its colour."""
    for package, folder in FOLDERS.items():
        if module == package or module.startswith(f"{package}."):
            return folder
    return LIBRARY


def path_of(module: str) -> Path:
    """Where a module or package lies."""
    parts = module.split(".")[1:]
    folder = ROOT if parts[0] in ("models", "systems", "analyses") else ROOT / "cdpr_drake"
    path = folder.joinpath(*parts)
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def first_line(module: str) -> str:
    """The first line of a docstring."""
    text = ast.get_docstring(ast.parse(path_of(module).read_text(encoding="utf-8"))) or ""
    return " ".join(text.split("\n\n")[0].split())


def rooms() -> list[str]:
    """Modules and packages that layers name, from the top down, the studio once."""
    found: list[str] = []
    for layer in layers():
        for module in sorted(layer):
            if module.startswith("cdpr_drake.studio."):
                module = "cdpr_drake.studio"
            if module not in found:
                found.append(module)
    return found


def label(module: str) -> str:
    """What stands in a box: the path below its folder."""
    words = module.removeprefix("cdpr_drake.").split(".")
    return (
        "/".join(
            words if folder_of(module) in ((LIBRARY), FOLDERS["cdpr_drake.cli"]) else words[1:]
        )
        or words[0]
    )


def picture() -> str:
    """The layers as SVG: a row each, boxes coloured by folder, a line between wings and core."""
    parts, y, shown, above = [], GAP, None, ""
    for layer in layers():
        if above and not wing_of(layer[0]):
            parts.append(
                f'<line x1="0" y1="{y + GAP}" x2="{WIDTH}" y2="{y + GAP}" stroke="#555555" '
                f'stroke-dasharray="6 4"/>'
                f'<text x="{WIDTH - GAP}" y="{y - 2}" text-anchor="end">wings</text>'
                f'<text x="{WIDTH - GAP}" y="{y + 24}" text-anchor="end">core</text>'
            )
            y += 2 * GAP
        above = wing_of(layer[0])
        labels = [(label(module), folder_of(module)) for module in layer]
        x, rows = LEFT, 1
        if labels[0][1] != shown:
            shown = labels[0][1]
            y += GAP
            parts.append(
                f'<text x="{GAP}" y="{y + 17}" font-weight="bold">{escape(shown[0])}</text>'
            )
        for words, (_, colour) in labels:
            wide = LETTER * len(words) + 16
            if x + wide > WIDTH and x > LEFT:
                x, rows = LEFT, rows + 1
                y += HEIGHT + GAP // 2
            parts.append(
                f'<rect x="{x:.0f}" y="{y}" width="{wide:.0f}" height="{HEIGHT}" rx="3" '
                f'fill="{colour}" stroke="#555555"/>'
                f'<text x="{x + wide / 2:.0f}" y="{y + 17}" text-anchor="middle">'
                f"{escape(words)}</text>"
            )
            x += wide + GAP
        y += HEIGHT + GAP
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {y}" '
        'font-family="sans-serif" font-size="12">\n'
        f'<rect width="{WIDTH}" height="{y}" fill="#ffffff"/>\n'
    )
    return head + "\n".join(parts) + "\n</svg>\n"


def listed() -> str:
    """The rooms as lists in Markdown, core and wings: where, and what for."""
    wings = tools()["rooms"]["wings"]
    rows = dict.fromkeys(("", *wings), "")
    for module in rooms():
        path = path_of(module)
        where = (path.parent if path.name == "__init__.py" else path).relative_to(ROOT).as_posix()
        rows[wing_of(module)] += f"- `{where}`: {first_line(module)}\n"
    core = [module for layer in layers() for module in layer if not wing_of(module)]
    every = [package for packages in wings.values() for package in packages]
    parts = [f"**The core**, {thousands(core)} lines:\n\n{rows['']}"]
    parts.append(f"**The wings**, {thousands(every)} lines:\n")
    for wing, packages in wings.items():
        parts.append(f"*{wing}*, {thousands(packages)}\n\n{rows[wing]}")
    return "\n".join(parts)


def same(old: str, new: str) -> bool:
    """True if texts differ by nothing but numbers of lines, each within `TOLERANCE`."""
    number = re.compile(r"(\d+\.\d)k\b")
    if number.sub("", old) != number.sub("", new):
        return False
    pairs = zip(number.findall(old), number.findall(new), strict=True)
    return all(abs(float(a) - float(b)) <= max(0.11, TOLERANCE * float(b)) for a, b in pairs)


def page() -> str:
    """ARCHITECTURE.md with the list of today.

    Raises:
        SystemExit: The page has no place for it.
    """
    text = PAGE.read_text(encoding="utf-8")
    if BEGIN not in text or END not in text:
        raise SystemExit(f"{PAGE.name}: found no place for the rooms; accepted: {BEGIN.strip()}")
    inside = re.compile(re.escape(BEGIN) + ".*?" + re.escape(END), re.DOTALL)
    return inside.sub(lambda _: f"{BEGIN}{listed()}{END}", text)


def main() -> int:
    """Writes both, or says which is old."""
    check_order()
    made = {PICTURE: picture(), PAGE: page()}
    if "--check" not in sys.argv[1:]:
        for path, text in made.items():
            path.write_text(text, encoding="utf-8")
        return 0
    today = {path: path.read_text(encoding="utf-8") for path in made}
    old = [path.name for path, text in made.items() if not same(today[path], text)]
    for name in old:
        print(f"{name} is not what the code says; python -m docs.rooms writes it")
    return int(bool(old))


if __name__ == "__main__":
    sys.exit(main())
