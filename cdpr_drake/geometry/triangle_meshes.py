"""Triangles of meshes: in blocks with boxes round them, and out of Wavefront files."""

from __future__ import annotations

from typing import Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import SensorError

BLOCK_SIZE = 16
"""Triangles that share one box."""


def triangle_blocks(corners: Array) -> tuple[Array, Array]:
    """Triangles in blocks of neighbours.

    Args:
        corners: Shape (n, 3, 3), corner by corner [m].

    Returns:
        Boxes of the blocks, lower and upper corner, shape (b, 6) [m], and the triangles as
        `ray_casting_kernel` takes them, shape (b BLOCK_SIZE, 9) [m]; those that fill up the last
        block of a part are zero, and no ray meets them.
    """
    parts: list[Any] = []
    rest: list[Any] = [np.arange(len(corners))]
    middles = np.mean(corners, axis=1)
    while rest:  # halved across their longest side
        part = rest.pop()
        if len(part) <= BLOCK_SIZE:
            parts.append(part)
            continue
        here = middles[part]
        order = np.argsort(here[:, int(np.argmax(np.ptp(here, axis=0)))], kind="stable")
        half = len(part) // 2
        rest += [part[order[half:]], part[order[:half]]]
    boxes = np.empty((len(parts), 6))
    packed = np.zeros((len(parts) * BLOCK_SIZE, 9))
    for number, part in enumerate(parts):
        mine = corners[part]
        points = mine.reshape(-1, 3)
        boxes[number] = np.concatenate([np.min(points, axis=0), np.max(points, axis=0)])
        at = number * BLOCK_SIZE
        packed[at : at + len(part)] = np.hstack(
            [mine[:, 0], mine[:, 1] - mine[:, 0], mine[:, 2] - mine[:, 0]]
        )
    return boxes, packed


def fan_triangles(points: Array, faces: list[list[int]]) -> Array:
    """Triangles of polygons, each split from its first corner, shape (n, 3, 3) [m].

    Args:
        points: Shape (k, 3) [m].
        faces: Numbers of the corners of each polygon in turn.
    """
    rows = [(face[0], face[i], face[i + 1]) for face in faces for i in range(1, len(face) - 1)]
    return np.asarray(points[np.array(rows, dtype=int).reshape(-1, 3)])


def obj_triangles(text: str, name: str) -> Array:
    """Triangles of a Wavefront file, all its objects together, shape (n, 3, 3).

    Args:
        text: What it says.
        name: How messages call it.

    Raises:
        SensorError: It has no faces, or a line of it cannot be read.
    """
    points: list[list[float]] = []
    faces: list[list[int]] = []
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        try:
            if words[:1] == ["v"]:
                points.append([float(word) for word in words[1:4]])
                if len(points[-1]) != 3:
                    raise ValueError
            elif words[:1] == ["f"]:
                numbers = [int(word.split("/")[0]) for word in words[1:]]
                # From 1 on, or backwards from the newest point.
                faces.append([n - 1 if n > 0 else len(points) + n for n in numbers])
                if len(numbers) < 3 or min(faces[-1]) < 0 or 0 in numbers:
                    raise ValueError
        except ValueError:
            raise SensorError(
                f"{name}: line {number}: found {line[:60]!r}; accepted: v x y z, or f with three "
                "or more numbers of points"
            ) from None
    if not faces or max(max(face) for face in faces) >= len(points):
        raise SensorError(f"{name}: found no faces of its own points; accepted: a mesh of polygons")
    return fan_triangles(np.array(points), faces)
