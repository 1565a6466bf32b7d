"""Reads YAML of any source: `compose_yaml` gives its nodes, `load_yaml` their values.

All YAML goes through these two. They refuse what is large, nested deeply, or large once its
aliases are expanded: files of robots and scenarios are small, and a bomb is refused at once.
`other_kind` recognises a file that was given to the wrong loader by the keys at its top.
"""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import yaml
from yaml.composer import Composer
from yaml.constructor import SafeConstructor
from yaml.cyaml import CParser  # type: ignore[attr-defined]
from yaml.resolver import Resolver

from cdpr_drake.errors import CdprError
from cdpr_drake.schema.input_files import input_size
from cdpr_drake.schema.json_text import MOST_DEPTH, MOST_DIGITS

FILE_KINDS: dict[str, tuple[frozenset[str], str]] = {
    "a robot": (frozenset({"platform", "winch", "tension_bounds"}), "cdpr_drake.models.load_robot"),
    "a mechanism": (frozenset({"mechanism"}), "cdpr_drake.models.load_mechanism"),
    "a scenario": (frozenset({"robot", "duration"}), "cdpr_drake.systems.load_scenario"),
    "a camera": (
        frozenset({"view_angle_horizontal_deg", "view_angle_vertical_deg"}),
        "cdpr_drake.models.camera_catalogue.load_camera",
    ),
    "perturbation bounds": (
        frozenset({"r_bp", "r_A"}),
        "cdpr_drake.analyses.workspaces.stability_defaults.load_bounds",
    ),
}
"""Kinds of files: keys that each file of a kind has and no other, and its loader."""

MOST_BYTES = 262_144
"""Largest file; those of this package have up to 20 kB, and larger ones take seconds to parse."""

MOST_NODES = 100_000
"""Most keys and values of a file; those behind an alias count each time."""


class YamlTextError(CdprError, ValueError):
    """Text is not YAML, or too much of it; in words that follow a file's name."""

    def __init__(self, words: str, line: int | None = None) -> None:
        """With the line of the text where it is known, from 1."""
        super().__init__(words)
        self.line = line

    def at(self, path: object) -> str:
        """The words behind a file's name and the line."""
        return f"{path}{'' if self.line is None else f':{self.line}'}: {self}"


class _Reader(Composer, CParser, SafeConstructor, Resolver):
    """PyYAML's safe loader, over events of libyaml, with a bound on depth and on whole numbers."""

    depth = 0

    def __init__(self, content: str) -> None:
        CParser.__init__(self, content)
        Composer.__init__(self)
        SafeConstructor.__init__(self)
        Resolver.__init__(self)

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        self.depth += 1
        if self.depth > MOST_DEPTH:
            mark: Any = self.peek_event().start_mark  # type: ignore[union-attr]
            words = f"nested more than {MOST_DEPTH} deep"
            raise yaml.composer.ComposerError(None, None, words, mark)
        node: yaml.Node | None = super().compose_node(parent, index)
        self.depth -= 1
        return node

    def construct_yaml_int(self, node: yaml.ScalarNode) -> int:
        if len(node.value) > MOST_DIGITS:
            words = f"a whole number of more than {MOST_DIGITS} digits"
            raise yaml.constructor.ConstructorError(None, None, words, node.start_mark)
        return int(super().construct_yaml_int(node))


_Reader.add_constructor("tag:yaml.org,2002:int", _Reader.construct_yaml_int)  # type: ignore[type-var]


def compose_yaml(content: str) -> yaml.Node | None:
    """The nodes of a YAML text; None: it is empty.

    Raises:
        YamlTextError: It is none, is larger than `MOST_BYTES`, is nested deeper than `MOST_DEPTH`,
            has an alias within what it names, or more than `MOST_NODES` keys and values.
    """
    return _read(content, construct=False)


def load_yaml(content: str) -> Any:
    """The values of a YAML text: mappings, lists, words and numbers.

    Raises:
        YamlTextError: As `compose_yaml`, or a value is not what its tag says.
    """
    return _read(content, construct=True)


def _read(content: str, construct: bool) -> Any:
    if len(content) > MOST_BYTES:
        raise YamlTextError(_too_large(len(content.encode("utf-8", "replace"))))
    try:
        loader = _Reader(content)
        root = loader.get_single_node()
        large = too_many_nodes(root)
        if large:
            raise YamlTextError(large)
        if not construct:
            return root
        return None if root is None else loader.construct_document(root)
    except yaml.YAMLError as problem:
        mark = getattr(problem, "problem_mark", None)
        line = None if mark is None else mark.line + 1
        if isinstance(problem, yaml.reader.ReaderError):
            line = content.count("\n", 0, problem.position) + 1
        what = getattr(problem, "problem", None) or str(problem).splitlines()[0]
        raise YamlTextError(f"does not parse as YAML: {what}", line) from problem
    except YamlTextError:
        raise
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError,
            ValueError) as problem:  # fmt: skip  # an escape beyond Unicode; `!!int` without digits
        raise YamlTextError(f"does not parse as YAML: {problem}") from problem


def _too_large(size: int) -> str:
    return f"found {size:,} bytes; accepted: at most {MOST_BYTES:,}"


def other_kind(keys: Collection[str], accepted: Collection[str]) -> str:
    """Words for a file of another kind, with its loader; empty where nothing speaks for one.

    Args:
        keys: Those at the top of the file.
        accepted: Those that the loader knows.
    """
    for what, (marks, loader) in FILE_KINDS.items():
        if marks <= set(keys) and not marks & set(accepted):
            return f"found {what}; use {loader}"
    return ""


def too_many_bytes(path: Path) -> str:
    """Words for a file that is too large to be read, or empty ones; raises OSError."""
    size = input_size(path)
    if size <= MOST_BYTES:
        return ""
    return _too_large(size)


def too_many_nodes(root: yaml.Node | None) -> str:
    """Words for a document that is too large with its aliases expanded, or empty ones."""
    sizes: dict[int, int] = {}
    found = 0 if root is None else _size(root, sizes)
    if found <= MOST_NODES:
        return ""
    return (
        f"found more than {MOST_NODES:,} keys and values, those behind aliases counted each time; "
        "accepted: fewer"
    )


def _size(node: yaml.Node, sizes: dict[int, int]) -> int:
    """Number of nodes below and with one; each is looked at once.

    Raises:
        YamlTextError: An alias stands within what it names.
    """
    known = sizes.get(id(node))
    if known == 0:
        words = "found an alias within what it names; accepted: aliases of what has ended"
        raise YamlTextError(words, node.start_mark.line + 1)
    if known is not None:
        return known
    sizes[id(node)] = 0  # until it is known
    total = 1
    if isinstance(node, yaml.SequenceNode):
        total += sum(_size(child, sizes) for child in node.value)
    elif isinstance(node, yaml.MappingNode):
        total += sum(_size(key, sizes) + _size(value, sizes) for key, value in node.value)
    sizes[id(node)] = total
    return total
