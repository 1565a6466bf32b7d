"""Messages between a run and a process outside as bytes, and what is checked of them."""

from __future__ import annotations

import json
import math
import threading
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import BridgeError, install_words
from cdpr_drake.schema.json_text import load_json

PROTOCOL = 1
"""Version of the messages."""

JSON, MSGPACK = "json", "msgpack"
"""How messages are written."""

LARGEST = 1 << 20
"""Longest message [bytes]."""

NUMBER = np.dtype("<f8")
"""Numbers where they are sent as bytes."""

LONGEST_WORDS = 200
"""Characters of a text from outside that are repeated in an error."""


def check_available() -> None:
    """Imports what the bridge needs.

    Raises:
        BridgeError: It is not installed.
    """
    try:
        import msgpack  # noqa: F401
        import zmq  # noqa: F401
    except ImportError as problem:
        raise BridgeError(
            f"the bridge: found no package {problem.name}; accepted: pyzmq and msgpack installed, "
            f"{install_words('bridge')}"
        ) from problem


class _Msgpack(threading.local):
    """What packs and unpacks in a thread; to make a packer costs more than to pack."""

    def __init__(self) -> None:
        import msgpack

        self.pack, self.unpack = msgpack.Packer().pack, msgpack.unpackb


@cache
def _msgpack() -> _Msgpack:
    return _Msgpack()


def encode(message: Mapping[str, Any], codec: str) -> bytes:
    """A message as bytes; lists of numbers must be finite or, in JSON, have None.

    Args:
        message: Texts, numbers, lists and objects.
        codec: `JSON` or `MSGPACK`.
    """
    if codec == JSON:
        return json.dumps(message, allow_nan=False, separators=(",", ":")).encode()
    packed: bytes = _msgpack().pack(message)
    return packed


def decode(payload: bytes) -> tuple[dict[str, Any], str]:
    """A message, and how it was written.

    Raises:
        BridgeError: It is neither JSON nor msgpack, no object, or too long.
    """
    if len(payload) > LARGEST:
        raise BridgeError(f"message: found {len(payload)} bytes; accepted: at most {LARGEST}")
    codec = JSON if payload[:1] == b"{" else MSGPACK
    try:
        found = load_json(payload, _no_number) if codec == JSON else _msgpack().unpack(payload)
    except (ValueError, TypeError) as problem:
        # Those of msgpack are ValueErrors, and so is UTF-8 that is none.
        words = shown(payload[:20])
        raise BridgeError(
            f"message: found {len(payload)} bytes that begin with {words}; accepted: one object "
            "as JSON or msgpack"
        ) from problem
    if not isinstance(found, dict):
        raise BridgeError(f"message: found {shown(found)}; accepted: one object")
    return found, codec


def _no_number(word: str) -> float:
    """JSON has no NaN and no infinity."""
    raise ValueError(word)


def shown(found: object) -> str:
    """Words of what came from outside, on one line and not too long."""
    words = repr(found)
    return words if len(words) <= LONGEST_WORDS else f"{words[:LONGEST_WORDS]}..."


_NUMBERS = {float, int}


def vector(name: str, found: object, size: int) -> Array:
    """Finite numbers as an array, shape (size,), from a list or, in msgpack, bytes.

    Raises:
        BridgeError: It is something else.
    """
    if type(found) is bytes and len(found) == 8 * size:
        found = np.frombuffer(found, NUMBER).tolist()
    if type(found) is not list or len(found) != size or not set(map(type, found)) <= _NUMBERS:
        count = f"{len(found)} entries: " if isinstance(found, list) else ""
        raise BridgeError(
            f"{name}: found {count}{shown(found)}; accepted: a list of {size} finite numbers"
        )
    if not _are_finite(found):
        raise BridgeError(f"{name}: found {shown(found)}; accepted: {size} finite numbers")
    return np.array(found, dtype=float)


def _are_finite(numbers: list[float]) -> bool:
    """Whether all are; a sum of few numbers costs a fraction of what NumPy takes."""
    try:
        return math.isfinite(sum(numbers)) or all(map(math.isfinite, numbers))
    except OverflowError:  # a whole number with hundreds of digits
        return False


def listed(values: Array, codec: str, packed: bool = False) -> list[float | None] | bytes:
    """An array as a list, in JSON with None for what is no number; or as bytes, if `packed`."""
    if packed:
        return values.tobytes()
    numbers: list[float | None] = values.tolist()
    if codec == JSON:
        return [v if v is not None and math.isfinite(v) else None for v in numbers]
    return numbers
