"""What pages name in backticks, and whether files' schemas or the package have it."""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from setuptools import find_packages

from cdpr_drake.analyses.runs.seeds import Repetition
from cdpr_drake.analyses.templates import FILES, file_schema
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.studio.session import Workbench

ROOT = Path(__file__).parents[2]

FENCE = re.compile(r"^ *```.*?^ *```", re.DOTALL | re.MULTILINE)
SPAN = re.compile(r"(?<!`)`([^`\n]+(?:\n[^`\n]+)?)`(?!`)")
DOTTED = re.compile(r"([A-Za-z_]\w*(?:\.\w+)+)(?:=.*|\(.*)?")
CALL = re.compile(r"([A-Za-z_]\w*)\(.*\)")
CAMEL = re.compile(r"_?(?:[A-Z][a-z0-9]+){2,}|[A-Z][a-z]+[A-Z]\w*")
SNAKE = re.compile(r"[A-Za-z]\w*_\w*")

FILE = re.compile(
    r".*\.(csv|html|ipynb|jsonl?|jpg|md|mp4|npz|mat|pdf|png|py|pyi|toml|tsv|txt|xml|yaml|yml)"
)
"""Names of files, which are no keys."""

VALUES = {"robot": Robot, "cables": CableSet, "runs": Repetition, "bench": Workbench}
"""What the pages' own variables are, of which they name methods."""

PATTERNS = ("exit_NAME", "anchor_NAME", "scan_NAME")
"""Names of which a part stands for others."""

SOURCES = ("cdpr_drake", "models", "systems", "analyses", "notebooks")


def spans(text: str) -> list[str]:
    """What stands between backticks within sentences."""
    return [" ".join(span.split()) for span in SPAN.findall(FENCE.sub("", text))]


@cache
def key_paths() -> frozenset[str]:
    """Keys of robot and scenario files, from the root or from any section: `a.b.c` and `b.c`."""
    found: set[str] = set()

    def walk(node: Any, above: tuple[str, ...]) -> None:
        if isinstance(node, Mapping):
            for key, below in (node.get("properties") or {}).items():
                path = (*above, key)
                found.update(".".join(path[start:]) for start in range(len(path)))
                walk(below, path)
            for key in ("if", "then", "else", "items", "additionalProperties"):
                walk(node.get(key), above)
            for key in ("anyOf", "oneOf", "allOf"):
                for part in node.get(key) or ():
                    walk(part, above)

    for kind in FILES:
        walk(file_schema(kind).schema, ())
    return frozenset(found)


@cache
def words_of_sources() -> frozenset[str]:
    """Identifiers in the package, its data, its tests and notebooks."""
    found: set[str] = set()
    for folder in SOURCES:
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in (".py", ".yaml", ".tsv", ".js", ".ipynb") and path.is_file():
                found.update(re.findall(r"\w+", path.read_text(encoding="utf-8")))
    return frozenset(found)


def is_of_the_package(path: str) -> bool:
    """Whether a dotted path leads from a room, a public class or a value of `VALUES` to a name."""
    first, *rest = path.split(".")
    if first in VALUES and _has(VALUES[first], rest):
        return True
    if first in public_names():
        return _has(public_names()[first], rest)
    roots = ("", "cdpr_drake.", "cdpr_drake.models.", "cdpr_drake.systems.", "cdpr_drake.analyses.")
    return any(_leads(f"{root}{path}".split(".")) for root in roots)


def _leads(words: list[str]) -> bool:
    if words[0] not in ("cdpr_drake", "dataclasses"):
        return False
    for split in range(len(words), 0, -1):
        try:
            module = importlib.import_module(".".join(words[:split]))
        except ModuleNotFoundError:
            continue
        return _has(module, words[split:])
    return False


def _has(owner: Any, names: list[str]) -> bool:
    for name in names:
        if not hasattr(owner, name):
            written = inspect.getsource(owner) if inspect.isclass(owner) else ""
            return (
                name in getattr(owner, "__dataclass_fields__", ())
                or re.search(rf"\bself\.{name}\b", written) is not None
            )
        owner = getattr(owner, name)
    return True


@cache
def public_names() -> dict[str, Any]:
    """What rooms export, by name."""
    found: dict[str, Any] = {}
    for name in find_packages(str(ROOT), include=["cdpr_drake", "cdpr_drake.*"]):
        room = importlib.import_module(name)
        found |= {word: getattr(room, word) for word in getattr(room, "__all__", ())}
    return found


def unknown_names(text: str) -> Iterator[str]:
    """Names in backticks that neither a file's schema nor the package nor its data have."""
    for span in spans(text):
        dotted, called = DOTTED.fullmatch(span), CALL.fullmatch(span)
        if FILE.fullmatch(span):
            continue
        if dotted:
            path = dotted[1]
            if path not in key_paths() and not is_of_the_package(path):
                yield span
        elif called or CAMEL.fullmatch(span) or SNAKE.fullmatch(span):
            name = called[1] if called else span
            known = any(word in words_of_sources() for word in (name, name.strip("_")))
            if not known and not name.startswith(PATTERNS):
                yield span
