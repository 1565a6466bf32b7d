"""YAML that was parsed before: the same small files are read again and again.

A run reads its robot five times and a study hundreds of times, and PyYAML takes 5 ms each time in
each of three passes. What a file says is checked every time all the same, as that may change.
"""

from __future__ import annotations

import copy
from collections import OrderedDict
from threading import Lock
from typing import Any

import yaml
from pydrake.common.yaml import yaml_load_typed

SMALL, MOST = 20_000, 32
"""Letters of files that are kept, and how many of them."""


class KnownYaml:
    """Nodes of a text, and the instance of a schema that they make.

    Who checks the nodes writes numbers and words plainly into them, which changes nothing when it
    is done again. What is refused has to be forgotten, since its nodes may be changed by half.
    """

    def __init__(self, schema: type, content: str) -> None:
        self._schema, self._content = schema, content
        self._root: yaml.Node | None = None
        self._made: Any = None

    def nodes(self) -> yaml.Node | None:
        """Its nodes; raises what PyYAML does."""
        if self._root is None:
            self._root = yaml.compose(self._content, Loader=yaml.SafeLoader)
        return self._root

    def instance(self) -> Any:
        """An instance of the schema of one's own, by the nodes as they are at the first call."""
        if self._made is None:
            self._made = yaml_load_typed(schema=self._schema, data=yaml.serialize(self._root))
        return copy.deepcopy(self._made)

    def forget(self) -> None:
        """Lets the next one begin anew."""
        with _CHANGING:
            _KEPT.pop((self._schema, self._content), None)


_KEPT: OrderedDict[tuple[type, str], KnownYaml] = OrderedDict()
_CHANGING = Lock()


def known_yaml(schema: type, content: str, edited: bool) -> KnownYaml:
    """A text that was read before, or one anew.

    Args:
        schema: Dataclass.
        content: YAML.
        edited: Whether nodes will be changed beyond what a check does; such a one is not kept.
    """
    found = None if edited else _KEPT.get((schema, content))
    if found is None:
        found = KnownYaml(schema, content)
    if not edited and len(content) <= SMALL:
        with _CHANGING:
            _KEPT[schema, content] = found
            _KEPT.move_to_end((schema, content))
            while len(_KEPT) > MOST:
                _KEPT.popitem(last=False)
    return found
