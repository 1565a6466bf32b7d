"""Logs of runs as MCAP, which Foxglove opens: JSON messages with a schema each.

A channel `/tf` has `foxglove.FrameTransform` of the platform's pose, where the log has one. Each
quantity of the log has a channel of its name, of objects with its columns and `time_s`, by which it
is read back as it was; times of messages are whole nanoseconds. What is not finite is left out of a
message, and a pose that is not has no transform: JSON has no such numbers, and null is no number of
the schema.

Source: mcap.dev/spec; docs.foxglove.dev/docs/sdk/schemas, FrameTransform, whose JSON schema says
which keys a message must have; docs.foxglove.dev/docs/getting-started/custom, schema encodings.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import OutputFormatError

MAGIC = b"\x89MCAP0\r\n"
"""A file begins with it."""

PROFILE, LIBRARY = "", "cdpr_drake"

FRAMES = "/tf"

WORLD, PLATFORM = "world", "platform"

TIME_KEY = "time_s"
"""Key of a row's time in the messages of a quantity [s]."""

_NUMBER = {"type": "number"}


def _object(**properties: Any) -> dict[str, Any]:
    """The schema of an object that has all of these."""
    return {"type": "object", "properties": properties, "required": list(properties)}


_TRANSFORM = _object(
    timestamp=_object(
        sec={"type": "integer", "minimum": 0},
        nsec={"type": "integer", "minimum": 0, "maximum": 999_999_999},
    ),
    parent_frame_id={"type": "string"},
    child_frame_id={"type": "string"},
    translation=_object(x=_NUMBER, y=_NUMBER, z=_NUMBER),
    rotation=_object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER),
)


def nanoseconds(time: float) -> int:
    """A time [s] in whole nanoseconds."""
    return round(time * 1e9)


def write_mcap(
    path: Path, time: Array, quantities: dict[str, tuple[list[str], Array]], pose: Array | None
) -> None:
    """Writes a log.

    Args:
        path: The file.
        time: Shape (n,), not negative [s].
        quantities: Names of columns and values, shape (n, k), by quantity.
        pose: Of the platform in W, quaternion wxyz and position, shape (n, 7) [m]; None.

    Raises:
        OutputFormatError: A time is below 0 or not finite, which the format has not.
    """
    from mcap.writer import Writer

    if len(time) and not (np.isfinite(time).all() and time.min() >= 0.0):
        raise OutputFormatError(f"{path}: time: found {time.min():g}; accepted by mcap: >= 0 [s]")
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile=PROFILE, library=LIBRARY)

        def channel(topic: str, name: str, schema: dict[str, Any]) -> int:
            text = json.dumps(schema).encode()
            known = writer.register_schema(name=name, encoding="jsonschema", data=text)
            return int(writer.register_channel(topic, "json", known))

        channels = []
        if pose is not None:
            frames = channel(FRAMES, "foxglove.FrameTransform", _TRANSFORM)
            channels.append((frames, _transforms(time, pose)))
        for quantity, (names, values) in quantities.items():
            schema = _object(**dict.fromkeys((TIME_KEY, *names), _NUMBER))
            schema["required"] = [TIME_KEY]
            number = channel(f"/{quantity}", f"cdpr_drake.{quantity}", schema)
            channels.append((number, _rows(time, names, values)))
        for k, messages in enumerate(zip(*(each for _, each in channels), strict=True)):
            at = nanoseconds(float(time[k]))
            for (number, _), message in zip(channels, messages, strict=True):
                if message is None:
                    continue
                data = json.dumps(message, allow_nan=False).encode()
                writer.add_message(number, log_time=at, data=data, publish_time=at, sequence=k)
        writer.finish()


def _transforms(time: Array, pose: Array) -> Iterator[dict[str, Any] | None]:
    for t, row in zip(time.tolist(), pose.tolist(), strict=True):
        if not np.isfinite(row).all():
            yield None
            continue
        w, x, y, z, px, py, pz = row
        sec, nsec = divmod(nanoseconds(t), 1_000_000_000)
        yield {
            "timestamp": {"sec": sec, "nsec": nsec},
            "parent_frame_id": WORLD, "child_frame_id": PLATFORM,
            "translation": {"x": px, "y": py, "z": pz},
            "rotation": {"x": x, "y": y, "z": z, "w": w},
        }  # fmt: skip


def _rows(time: Array, names: list[str], values: Array) -> Iterator[dict[str, Any]]:
    good = np.isfinite(values)
    for t, row, known in zip(time.tolist(), values.tolist(), good.tolist(), strict=True):
        each = zip(names, row, known, strict=True)
        yield {TIME_KEY: t, **{name: x for name, x, finite in each if finite}}
