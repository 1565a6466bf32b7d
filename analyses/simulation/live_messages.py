"""Messages between a run and who steers it: JSON, followed by bytes where there is an image.

A run says:

======== ==========================================================================================
kind     with
======== ==========================================================================================
begin    scenario, title, robot, cables (names), limits (two tensions [N]), duration [s], period of
         the log [s], takes (what may be done to it by hand: break, push)
sample   t [s], position_error [m], rotation_error [rad], tensions [N], lengths [m], unstrained
         [m] or null, pose (quaternion w x y z, position [m]), outcome
image    t [s], then the image as JPEG
pace     t [s], paused, speed: a factor, or null for as fast as possible; after each change of them
event    t [s], words: what was done by hand, or refused: why it was not
======== ==========================================================================================

It is told by messages of the kind `do`, with `what`: pause, go, step (with `seconds`, or null for
the period of the log), speed (with `factor`, or null), stop, break (with `cable`, its number), push
(with `force` [N] in W and `seconds`, a half sine). Who hangs up stops the run.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import Any

from cdpr_drake.errors import CdprError
from cdpr_drake.schema.json_text import load_json

LARGEST_MESSAGE = 16 * 2**20
"""Bytes of a message or image; more is no message of ours."""


@dataclass(frozen=True)
class Message:
    """One message.

    Attributes:
        kind: What it is.
        data: What it says, for JSON.
        blob: What follows it; empty: nothing.
    """

    kind: str
    data: dict[str, Any] = field(default_factory=dict)
    blob: bytes = b""


def open_connection(descriptor: int) -> Connection:
    """The end of a connection that was handed over as an open file descriptor.

    Raises:
        CdprError: There is none.
    """
    try:
        return Connection(descriptor)
    except (OSError, ValueError) as problem:
        raise CdprError(
            f"descriptor: found {descriptor}; accepted: the number of an open socket"
        ) from problem


def send(connection: Connection, message: Message) -> None:
    """Sends a message.

    Raises:
        OSError: Nobody is there any more.
    """
    head = {"kind": message.kind, "blob": len(message.blob), **message.data}
    connection.send_bytes(json.dumps(plain(head), allow_nan=False).encode())
    if message.blob:
        connection.send_bytes(message.blob)


def receive(connection: Connection) -> Message:
    """The next message, waiting for it.

    Raises:
        EOFError: Who was there hung up.
        OSError: The connection broke.
        ValueError: That was no message.
    """
    head = load_json(connection.recv_bytes(LARGEST_MESSAGE))
    if not isinstance(head, dict) or not isinstance(head.get("kind"), str):
        raise ValueError("found no kind in a message")
    kind, size = head.pop("kind"), head.pop("blob", 0)
    blob = connection.recv_bytes(LARGEST_MESSAGE) if size else b""
    return Message(kind, head, blob)


def plain(value: Any) -> Any:
    """For JSON as browsers read it: numbers that are not finite become None."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
