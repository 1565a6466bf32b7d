"""What was found in a YAML file, in words that fit into a message of one line."""

from __future__ import annotations

import yaml


def printable(words: str) -> str:
    """The words as they are, or quoted with escapes where they would break the line."""
    return words if words.isprintable() else repr(words)


def show(node: yaml.Node) -> str:
    """A node as it could stand in a file, cut to 60 characters."""
    if isinstance(node, yaml.ScalarNode):
        words = printable(str(node.value)) or "nothing"
    else:
        words = printable(_flow(node))
    return words if len(words) <= 60 else words[:57] + "..."


def _flow(node: yaml.Node) -> str:
    if isinstance(node, yaml.SequenceNode):
        return "[" + ", ".join(_flow(child) for child in node.value) + "]"
    if isinstance(node, yaml.MappingNode):
        return "{" + ", ".join(f"{_flow(k)}: {_flow(v)}" for k, v in node.value) + "}"
    return str(node.value)
