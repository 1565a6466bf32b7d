"""How large a YAML file may be: files of this package are small, and a bomb is told at once."""

from __future__ import annotations

from pathlib import Path

import yaml

MOST_BYTES = 262_144
"""Of a file; the largest of this package's own has 20 kB, and more would take seconds to parse."""

MOST_NODES = 100_000
"""Keys and values of a file, those that an alias repeats counted again."""


def too_many_bytes(path: Path) -> str:
    """Words for a file that is too large to be read, or empty ones; raises OSError."""
    size = path.stat().st_size
    if size <= MOST_BYTES:
        return ""
    return f"found {size:,} bytes; accepted: at most {MOST_BYTES:,}"


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

    An anchor that contains itself counts as more than is accepted.
    """
    known = sizes.get(id(node))
    if known is not None:
        return known
    sizes[id(node)] = MOST_NODES + 1  # until it is known, should it lie within itself
    total = 1
    if isinstance(node, yaml.SequenceNode):
        total += sum(_size(child, sizes) for child in node.value)
    elif isinstance(node, yaml.MappingNode):
        total += sum(_size(key, sizes) + _size(value, sizes) for key, value in node.value)
    sizes[id(node)] = total
    return total
