"""Types of a kernel's arguments as words, as `f8[:,::1], i8`, and back.

The words are Python expressions of numba's own short names. numba is imported where they are read.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any


def signature_words(types: tuple[Any, ...]) -> str | None:
    """Writes types of arguments; None where one of them is of a kind that is not written."""
    written = [_words(each) for each in types]
    return None if None in written else "".join(f"{words}, " for words in written).rstrip()


def signature_of(words: str) -> tuple[Any, ...]:
    """Reads what `signature_words` has written: numba's types.

    Raises:
        ImportError, AttributeError: A class that is named is no longer there.
    """
    numba_types = import_module("numba").types
    names = {
        "Literal": numba_types.literal,
        "Omitted": numba_types.Omitted,
        "readonly": lambda array: array.copy(readonly=True),
        "Named": _named,
        **{name: getattr(numba_types, name) for name in _SHORT.values()},
    }
    # The words come from this package's own file.
    found = eval(f"({words})", {"__builtins__": {}}, names)
    return tuple(_typed(each) for each in found)


_SHORT = {
    "float64": "f8", "int64": "i8", "uint64": "u8", "int8": "i1", "bool": "b1", "complex128": "c16",
}  # fmt: skip


def _words(given: Any) -> str | None:
    """One type, or None."""
    kind = type(given).__name__
    if str(given) in _SHORT:
        return _SHORT[str(given)]
    if kind == "Array" and given.aligned:
        dtype, more = _words(given.dtype), [":"] * (given.ndim - 1)
        axes = {"C": [*more, "::1"], "F": ["::1", *more], "A": [":", *more]}[given.layout]
        written = None if dtype is None else f"{dtype}[{','.join(axes)}]"
        return written if given.mutable or written is None else f"readonly({written})"
    if kind in ("UniTuple", "Tuple", "NamedTuple", "NamedUniTuple"):
        if kind == "UniTuple":
            dtype = _words(given.dtype)
            return None if dtype is None else f"({dtype},)*{given.count}"
        inner = signature_words(tuple(given.types))
        if inner is None or kind == "Tuple":
            return inner and f"({inner})"
        where = given.instance_class
        return f"Named({where.__module__!r}, {where.__qualname__!r}, {inner})"
    if kind.endswith("Literal") and isinstance(given.literal_value, int):
        return f"Literal({given.literal_value!r})"
    if kind == "Omitted" and isinstance(given.value, float):
        return f"Omitted({given.value!r})"
    return None


def _typed(found: Any) -> Any:
    """A type, where plain tuples of Python stand for numba's."""
    if not isinstance(found, tuple):
        return found
    return sys.modules["numba"].types.BaseTuple.from_types([_typed(each) for each in found])


def _named(module: str, name: str, *inner: Any) -> Any:
    """The type of a NamedTuple of this package."""
    types = import_module("numba").types
    return types.BaseTuple.from_types(
        [_typed(each) for each in inner], getattr(import_module(module), name)
    )
