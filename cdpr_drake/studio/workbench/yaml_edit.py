"""Changes one value in the text of a YAML file, and nothing else: comments and order stay.

The text is edited where the value stands. What comes out is read again and compared with what was
meant; where it differs, as with anchors or odd layouts, the whole text is written anew instead.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import yaml

from cdpr_drake.schema.yaml_files import YamlTextError, compose_yaml, load_yaml

Path = Sequence[str | int]
"""Keys and numbers of items, from the top."""

Node = yaml.Node


def with_value(text: str, path: Path, value: Any, order: Sequence[str] = ()) -> str:
    """The text with another value at a path; sections on the way that are not there are added.

    Args:
        text: YAML, a mapping at its top.
        path: Where; a key that is not there yet is added.
        value: Numbers, texts, switches, None, and lists and mappings of them.
        order: Keys of the mapping in their usual order, for one that is added.
    """
    data = load_yaml(text)
    for depth in range(1, len(path)):
        if not has(data, path[:depth]) or _at(data, path[:depth]) is None:
            for key in reversed(path[depth:]):
                value = {key: value}
            path = path[:depth]
            break
    parent = _at(data, path[:-1])
    parent[path[-1]] = value
    return _checked(_put(text, path, value, order), text, data)


def with_item(text: str, path: Path, value: Any) -> str:
    """The text with one more item at the end of the list at a path, made if it is not there."""
    data = load_yaml(text)
    parent = _at(data, path[:-1])
    found = parent.get(path[-1]) if isinstance(parent, dict) else parent[path[-1]]
    if not found:
        return with_value(text, path, [value])
    found.append(value)
    return _checked(_append(text, path, value), text, data)


def without_item(text: str, path: Path) -> str:
    """The text without the item of a list at a path."""
    data = load_yaml(text)
    del _at(data, path[:-1])[path[-1]]
    return _checked(_remove(text, path), text, data)


def flow(value: Any) -> str:
    """A value in one line of YAML, numbers with all their digits."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return _float_words(value)
    if isinstance(value, list):
        return "[" + ", ".join(flow(item) for item in value) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {flow(item)}" for key, item in value.items()) + "}"
    return _text_words(str(value))


def _float_words(value: float) -> str:
    """So that YAML reads a number, which it does not in 1e-06."""
    words = repr(value)
    mantissa, e, exponent = words.partition("e")
    return words if not e or "." in mantissa else f"{mantissa}.0e{exponent}"


def _text_words(words: str) -> str:
    plain = words.isascii() and words.replace("_", "").replace("-", "").isalnum()
    if plain and words[0].isalpha() and load_yaml(words) == words:
        return words
    return json.dumps(words, ensure_ascii=False)


def has(data: Any, path: Path) -> bool:
    """Whether there is something at a path."""
    try:
        _at(data, path)
    except (KeyError, IndexError, TypeError):
        return False
    return True


def _at(data: Any, path: Path) -> Any:
    for key in path:
        data = data[key]
    return data


def _checked(new: str | None, text: str, wanted: Any) -> str:
    """The edited text if it means what is wanted, else all of it written anew."""
    try:
        if new is not None and _same(load_yaml(new), wanted):
            return new
    except YamlTextError:
        pass
    return yaml.safe_dump(
        wanted, sort_keys=False, allow_unicode=True, default_flow_style=None, width=100
    )


def _same(found: Any, wanted: Any) -> bool:
    if isinstance(wanted, dict):
        return (
            isinstance(found, dict)
            and found.keys() == wanted.keys()
            and all(_same(found[key], wanted[key]) for key in wanted)
        )
    if isinstance(wanted, list):
        return (
            isinstance(found, list)
            and len(found) == len(wanted)
            and all(_same(one, other) for one, other in zip(found, wanted, strict=True))
        )
    if isinstance(wanted, float) and wanted != wanted:
        return isinstance(found, str) and found == "nan"
    if isinstance(wanted, float) and isinstance(found, str):  # inf
        return found == repr(wanted)
    return type(found) is type(wanted) and bool(found == wanted)


def _node(root: Node | None, path: Path) -> Node | None:
    for key in path:
        if isinstance(root, yaml.SequenceNode) and isinstance(key, int):
            if key >= len(root.value):
                return None
            root = root.value[key]
        elif isinstance(root, yaml.MappingNode):
            found = next((child for name, child in root.value if name.value == key), None)
            if found is None:
                return None
            root = found
        else:
            return None
    return root


def _is_flow(node: Node) -> bool:
    return bool(getattr(node, "flow_style", False))


def _content_end(node: Node) -> int:
    """Where a node ends without the space and comments that YAML counts to it."""
    if not isinstance(node, yaml.CollectionNode) or _is_flow(node) or not node.value:
        return int(node.end_mark.index)
    last = node.value[-1]
    return _content_end(last[1] if isinstance(last, tuple) else last)


def _line_end(text: str, index: int) -> int:
    """The end of the line of a place, or the place where a line has just begun."""
    if index > 0 and text[index - 1] == "\n":
        return index - 1
    end = text.find("\n", index)
    return len(text) if end < 0 else end


def _put(text: str, path: Path, value: Any, order: Sequence[str]) -> str | None:
    root = compose_yaml(text)
    node, parent = _node(root, path), _node(root, path[:-1])
    if node is not None:
        start, end = node.start_mark.index, _content_end(node)
        words = flow(value)
        if isinstance(node, yaml.ScalarNode) and node.style in ("|", ">"):
            words += "\n"
        elif isinstance(node, yaml.CollectionNode) and not _is_flow(node):
            # What stood on lines of its own now stands behind its key.
            start = len(text[:start].rstrip())
            words = f" {words}"
        return f"{text[:start]}{words}{text[end:]}"
    if not isinstance(parent, yaml.MappingNode):
        return None
    pair = f"{path[-1]}: {flow(value)}"
    if _is_flow(parent):
        end = parent.end_mark.index - 1
        return f"{text[:end].rstrip()}{', ' if parent.value else ''}{pair}{text[end:]}"
    later = set(order[list(order).index(str(path[-1])) + 1 :]) if path[-1] in order else set()
    column = parent.value[0][0].start_mark.column
    for name, _ in parent.value:
        if name.value in later:
            start = name.start_mark.index
            return f"{text[:start]}{pair}\n{' ' * column}{text[start:]}"
    end = _line_end(text, _content_end(parent))
    return f"{text[:end]}\n{' ' * column}{pair}{text[end:]}"


def _append(text: str, path: Path, value: Any) -> str | None:
    node = _node(compose_yaml(text), path)
    if not isinstance(node, yaml.SequenceNode):
        return None
    if _is_flow(node):
        end = node.end_mark.index - 1
        return f"{text[:end].rstrip()}, {flow(value)}{text[end:]}"
    end = _line_end(text, _content_end(node))
    return f"{text[:end]}\n{' ' * node.start_mark.column}- {flow(value)}{text[end:]}"


def _remove(text: str, path: Path) -> str | None:
    parent = _node(compose_yaml(text), path[:-1])
    if not isinstance(parent, yaml.SequenceNode) or _is_flow(parent) or len(parent.value) < 2:
        return None
    number = path[-1]
    assert isinstance(number, int)
    node = parent.value[number]
    start = text.rfind("\n", 0, node.start_mark.index)
    return f"{text[:start]}{text[_line_end(text, _content_end(node)) :]}"
