"""Changes one value in the text of a YAML file, and nothing else: comments and order stay.

The text is edited where the value stands. What comes out is read again and compared with what was
meant; where it differs, as with anchors or odd layouts, the whole text is written anew instead.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import is_dataclass
from typing import Any

import yaml

from cdpr_drake.schema.yaml_files import YamlTextError, compose_yaml, load_yaml

Place = tuple[str | int, ...]
"""Keys and numbers of items, from the top."""


def with_value(text: str, place: Place, value: Any, order: Sequence[str] = ()) -> str:
    """The text with another value at a place; sections on the way that are not there are added.

    Args:
        text: YAML, a mapping at its top.
        place: Where; a key that is not there yet is added.
        value: Numbers, texts, switches, None, and lists and mappings of them.
        order: Keys of the mapping in their usual order, for one that is added.
    """
    data = load_yaml(text)
    there = (value_in(data, place[:depth]) is not None for depth in range(1, len(place)))
    depth = next((depth for depth, is_there in enumerate(there, 1) if not is_there), len(place))
    for key in reversed(place[depth:]):
        value = {key: value}
    place = place[:depth]
    parent = value_in(data, place[:-1])
    if isinstance(parent, list) and place[-1] == len(parent):
        parent.append(value)
    else:
        parent[place[-1]] = value
    return _checked(_put(text, place, value, order), data)


def with_item(text: str, place: Place, value: Any) -> str:
    """The text with one more item at the end of the list at a place, made if it is not there."""
    items = value_in(load_yaml(text), place)
    if items:
        return with_value(text, (*place, len(items)), value)
    return with_value(text, place, [value])


def without_item(text: str, place: Place) -> str:
    """The text without the item of a list at a place."""
    data = load_yaml(text)
    *above, number = place
    del value_in(data, tuple(above))[number]
    items = _node(compose_yaml(text), above)
    if not isinstance(items, yaml.SequenceNode) or items.flow_style or len(items.value) < 2:
        return _checked(None, data)
    node = items.value[int(number)]
    start = text.rfind("\n", 0, node.start_mark.index)
    return _checked(f"{text[:start]}{text[_line_end(text, _content_end(node)) :]}", data)


def value_in(data: Any, place: Place) -> Any:
    """What stands at a place in plain values or settings; None: nothing."""
    for key in place:
        try:
            data = getattr(data, str(key)) if is_dataclass(data) else data[key]
        except (AttributeError, KeyError, IndexError, TypeError):
            return None
    return data


class _Flow(yaml.SafeDumper):
    """PyYAML's, with quotes around words that are no names."""


def _words(dumper: yaml.SafeDumper, words: str) -> yaml.Node:
    style = None if re.fullmatch("[A-Za-z][A-Za-z0-9_-]*", words) else '"'
    return dumper.represent_scalar("tag:yaml.org,2002:str", words, style=style)


_Flow.add_representer(str, _words)


def flow(value: Any) -> str:
    """A value in one line of YAML, numbers with all their digits."""
    words: str = yaml.dump(
        value, Dumper=_Flow, default_flow_style=True, sort_keys=False, allow_unicode=True,
        width=math.inf,
    )  # fmt: skip
    return words.removesuffix("...\n").rstrip("\n")


def _checked(new: str | None, meant: Any) -> str:
    """The edited text if it means what is meant, else all of it written anew."""
    try:
        if new is not None and load_yaml(new) == meant:
            return new
    except YamlTextError:
        pass
    words: str = yaml.safe_dump(
        meant, sort_keys=False, allow_unicode=True, default_flow_style=None, width=100
    )
    return words


def _put(text: str, place: Place, value: Any, order: Sequence[str]) -> str | None:
    root, words = compose_yaml(text), flow(value)
    node, parent = _node(root, place), _node(root, place[:-1])
    if node is not None:
        start, end = node.start_mark.index, _content_end(node)
        if isinstance(node, yaml.ScalarNode) and node.style in ("|", ">"):
            words += "\n"
        elif isinstance(node, yaml.CollectionNode) and not node.flow_style:
            # What stood on lines of its own now stands behind its key.
            start, words = len(text[:start].rstrip()), f" {words}"
        return f"{text[:start]}{words}{text[end:]}"
    if not isinstance(parent, yaml.CollectionNode):
        return None
    is_list = isinstance(parent, yaml.SequenceNode)
    if not is_list:
        words = f"{place[-1]}: {words}"
    if parent.flow_style:
        end = parent.end_mark.index - 1
        return f"{text[:end].rstrip()}{', ' if parent.value else ''}{words}{text[end:]}"
    margin = " " * parent.start_mark.column
    later = order[order.index(str(place[-1])) + 1 :] if place[-1] in order else ()
    for name, _ in () if is_list else parent.value:
        if name.value in later:
            start = name.start_mark.index
            return f"{text[:start]}{words}\n{margin}{text[start:]}"
    end = _line_end(text, _content_end(parent))
    return f"{text[:end]}\n{margin}{'- ' if is_list else ''}{words}{text[end:]}"


def _node(node: Any, place: Sequence[str | int]) -> yaml.Node | None:
    for key in place:
        children: dict[Any, yaml.Node] = {}
        if isinstance(node, yaml.SequenceNode):
            children = dict(enumerate(node.value))
        elif isinstance(node, yaml.MappingNode):
            children = {name.value: child for name, child in node.value}
        node = children.get(key)
    return node


def _content_end(node: yaml.Node) -> int:
    """Where a node ends without the space and comments that YAML counts to it."""
    if not isinstance(node, yaml.CollectionNode) or node.flow_style or not node.value:
        return int(node.end_mark.index)
    last = node.value[-1]
    return _content_end(last[1] if isinstance(last, tuple) else last)


def _line_end(text: str, index: int) -> int:
    """The end of the line of a place, or the place where a line has just begun."""
    if index > 0 and text[index - 1] == "\n":
        return index - 1
    end = text.find("\n", index)
    return len(text) if end < 0 else end
