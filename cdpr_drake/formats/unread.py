"""What of a file a reader used, and what is left: named as not kept.

A reader wraps the parsed document (`watched`) and reads it as before. Each key, attribute and text
that it asks for is recorded; `not_kept` names all others. Where another program reads the file, as
Drake or MuJoCo, the reader says what that took (`mark`).
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterator
from typing import Any

TEXT = "text()"
"""Stands for the text of an element among its attributes."""

_PLAIN: Any = vars(ET.Element)["text"]
"""The text of an element as the standard library has it."""

MOST_NAMED = 40
"""Parts of a file that a remark names; of more it says how many."""

MOST_OWNERS = 4
"""Elements whose parts they are that a remark names for each."""


class WatchedElement(ET.Element):
    """An element of XML that records which attributes and text were asked for."""

    def __init__(self, tag: str, attributes: dict[str, str]) -> None:
        super().__init__(tag, attributes)
        self.used: set[str] = set()

    @property
    def text(self) -> str | None:
        """Its text, which counts as used from then on."""
        self.used.add(TEXT)
        return self.bare_text()

    @text.setter
    def text(self, value: str | None) -> None:
        _PLAIN.__set__(self, value)

    def bare_text(self) -> str | None:
        """Its text, not counted as used."""
        found: str | None = _PLAIN.__get__(self)
        return found

    def get(self, key: str, default: Any = None) -> Any:
        """An attribute, which counts as used from then on."""
        self.used.add(key)
        return super().get(key, default)

    def findtext(self, path: str, default: Any = None, namespaces: Any = None) -> Any:
        """The text of the first element of a path, which counts as used."""
        found = self.find(path, namespaces)
        return default if found is None else found.text or ""

    def parts(self) -> set[str]:
        """Its attributes, and `TEXT` if it has some; of an empty element `TEXT` as well."""
        has_text = bool((self.bare_text() or "").strip())
        empty = not self.attrib and not len(self)
        return {*self.attrib, *({TEXT} if has_text or empty else ())}


class WatchedMapping(dict[Any, Any]):
    """A mapping of a document that records which keys were asked for."""

    def __init__(self) -> None:
        super().__init__()
        self.used: set[Any] = set()

    def __getitem__(self, key: Any) -> Any:
        """A value; its key counts as used from then on."""
        self.used.add(key)
        return super().__getitem__(key)

    def get(self, key: Any, default: Any = None) -> Any:
        """A value or a default; its key counts as used from then on."""
        self.used.add(key)
        return super().get(key, default)


def watched(document: Any, copies: dict[int, Any] | None = None) -> Any:
    """A copy of a parsed document, XML, JSON or YAML, that records what is read of it.

    Args:
        document: The document; YAML may have a part in several places, also in itself.
        copies: Copies of its parts by their identity; for the function itself.
    """
    copies = {} if copies is None else copies
    if id(document) in copies:
        return copies[id(document)]
    if isinstance(document, ET.Element):
        return _watched_element(document)
    if isinstance(document, dict):
        mapping = copies[id(document)] = WatchedMapping()
        mapping.update({key: watched(value, copies) for key, value in document.items()})
        return mapping
    if isinstance(document, list):
        items: list[Any] = []
        copies[id(document)] = items
        items += [watched(item, copies) for item in document]
        return items
    return document


def _watched_element(root: ET.Element) -> WatchedElement:
    """Files may be nested more deeply than functions."""
    copies: dict[ET.Element, WatchedElement] = {}
    for item in root.iter():
        copies[item] = WatchedElement(item.tag, dict(item.attrib))
        copies[item].text = item.text
    for item, copy in copies.items():
        copy.extend([copies[child] for child in item])
    return copies[root]


def mark(element: ET.Element, *attributes: str) -> None:
    """Counts attributes of one element as used, `TEXT` for its text; all of them without names."""
    assert isinstance(element, WatchedElement)
    element.used.update(attributes or element.parts())


def mark_below(part: Any) -> None:
    """Counts a part of a watched document and all below it as used."""
    if isinstance(part, ET.Element):
        for item in part.iter():
            if isinstance(item.tag, str):
                mark(item)
    for _, mapping in _mappings(part, "", set()):
        mapping.used.update(mapping)


def _mappings(part: Any, path: str, seen: set[int]) -> Iterator[tuple[str, WatchedMapping]]:
    """All mappings of a document with their paths, each once."""
    if id(part) in seen:
        return
    if isinstance(part, (WatchedMapping, list)):
        seen.add(id(part))
    if isinstance(part, WatchedMapping):
        yield path, part
        for key, value in part.items():
            yield from _mappings(value, f"{path}.{key}" if path else f"{key}", seen)
    if isinstance(part, list):
        for item in part:
            yield from _mappings(item, f"{path}[]", seen)


def not_kept(document: Any, presentation: Collection[str] = ()) -> list[str]:
    """A remark that names what was not used of a watched document; empty if all was.

    Args:
        document: What `watched` gave.
        presentation: Tags, keys and `TAG@ATTRIBUTE` that say only how things look or are called.
    """
    if isinstance(document, WatchedElement):
        left = _left_of_element(document, presentation)
    else:
        left = _left_of_mapping(document, presentation)
    found: dict[str, list[str]] = {}
    for where, name in left:
        found.setdefault(where, []).append(name)
    words = [where + _of(names) for where, names in found.items()]
    if len(words) > MOST_NAMED:
        words = [*words[:MOST_NAMED], f"{len(words) - MOST_NAMED} more"]
    return [f"Not kept: {', '.join(words)}."] if words else []


def _of(names: list[str]) -> str:
    """Whose parts they are, or how many."""
    some = [name for name in dict.fromkeys(names) if name]
    if not some:
        return "" if len(names) == 1 else f" ({len(names)} times)"
    more = [] if len(some) <= MOST_OWNERS else [f"{len(some) - MOST_OWNERS} more"]
    return f" of {', '.join([*some[:MOST_OWNERS], *more])}"


def _left_of_element(
    root: WatchedElement, presentation: Collection[str]
) -> Iterator[tuple[str, str]]:
    items = [item for item in root.iter() if isinstance(item, WatchedElement)]
    parents = {child: parent for parent in items for child in parent}
    used = {item: bool(item.used) for item in items}
    for item in reversed(items):
        if item is not root and used[item]:
            used[parents[item]] = True
    places: dict[ET.Element | None, tuple[str, str]] = {None: ("", "")}
    for item in items:
        above = places.get(parents.get(item))
        tag = str(item.tag).rpartition("}")[2]  # of comments it is a function
        if above is None or tag in presentation or not isinstance(item.tag, str):
            continue
        path, owner = above
        path = f"{path}/{tag}" if path else tag
        owner = item.attrib.get("name") or owner
        if not used[item]:
            yield path, owner
            continue
        places[item] = path, owner
        for part in sorted(item.parts() - item.used):
            if not {f"{tag}@{part}", f"@{part.rpartition('}')[2]}"} & set(presentation):
                yield (path if part == TEXT else f"{path}@{part}"), owner


def _left_of_mapping(content: Any, presentation: Collection[str]) -> Iterator[tuple[str, str]]:
    below: list[str] = []
    for path, mapping in _mappings(content, "", set()):
        if path in presentation or any(f"{path}.".startswith((f"{p}.", f"{p}[")) for p in below):
            continue
        for key in mapping:
            here = f"{path}.{key}" if path else f"{key}"
            if here not in presentation and key not in mapping.used:
                below.append(here)
                yield here, ""
