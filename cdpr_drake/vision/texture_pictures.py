"""Pictures of textures, and of what a camera sees of a target, drawn without a renderer.

`texture_picture` draws a texture by numbers from a seed: nobody's picture, the same on every
machine. `drawn_image` draws a target at a pose: each pixel is the mean of samples.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import cv2
import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.vision.apriltags import tag_corners
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import Target

TEXTURE_PIXELS = 256
"""Edge of a picture: cameras rarely see one with more than twice as few pixels, which a renderer
that samples without averaging would draw as noise."""

_FINE = 2
"""Samples along a pixel."""

_SOFTNESS = 0.7
"""Standard deviation of the blur that takes away what pixels cannot show [px]."""

_SEED = 7

SAMPLES = 4
"""Of a drawn image, along a pixel."""


@cache
def texture_picture(name: str) -> np.ndarray:
    """The picture of a texture, shape (256, 256), 8 bits, grey; not to be written to.

    Args:
        name: One of `TEXTURES`.
    """
    random = np.random.default_rng([_SEED, list(TEXTURES).index(name)])
    fine = TEXTURES[name](random, _FINE * TEXTURE_PIXELS)
    cells = fine.reshape(TEXTURE_PIXELS, _FINE, TEXTURE_PIXELS, _FINE).mean(axis=(1, 3))
    soft = cv2.GaussianBlur(cells, (0, 0), _SOFTNESS, borderType=cv2.BORDER_REPLICATE)
    picture = np.clip(np.round(soft), 0, 255).astype(np.uint8)
    picture.flags.writeable = False
    return picture


def drawn_image(
    target: Target, X_CO: RigidTransform, pinhole: Pinhole, *, ground: int = 150
) -> np.ndarray:
    """An image of a target's plates on a plain ground, shape (height, width, 3), 8 bits.

    Args:
        target: What is drawn; its plates do not hide each other.
        X_CO: Its pose in the camera [m]; all corners of its plates lie before the camera.
        pinhole: The camera.
        ground: Gray of what is round it, 0..255.
    """
    size = (SAMPLES * pinhole.width, SAMPLES * pinhole.height)
    samples = np.full(size[::-1], ground, np.uint8)
    for plate in target.plates():
        picture = cv2.imdecode(np.frombuffer(plate.png, np.uint8), cv2.IMREAD_GRAYSCALE)
        # The last pixel's middle is not its rim: what is beyond is that pixel, too.
        n, wider = picture.shape[0], 4
        fine = cv2.resize(picture, (wider * n, wider * n), interpolation=cv2.INTER_LINEAR)
        edge = wider * n
        source = np.array([[0, 0], [edge, 0], [edge, edge], [0, edge]], np.float32) - 0.5
        rim = pinhole.project(X_CO @ plate.X_OT @ tag_corners(plate.width)).T
        place = ((rim + 0.5) * SAMPLES - 0.5).astype(np.float32)
        H = cv2.getPerspectiveTransform(source, place)
        where = cv2.warpPerspective(np.full_like(fine, 255), H, size, flags=cv2.INTER_NEAREST)
        drawn = cv2.warpPerspective(fine, H, size, borderMode=cv2.BORDER_REPLICATE)
        cv2.copyTo(drawn, where, samples)
    gray = cv2.resize(samples, (pinhole.width, pinhole.height), interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.cvtColor(gray, cv2.COLOR_GRAY2RGB))


def _stones(random: np.random.Generator, size: int) -> Array:
    """Stones of all sizes with dark joints: cells round random points."""
    from scipy.spatial import cKDTree  # every simulation imports this module, few draw by it

    seeds = random.uniform(0.0, size, (140, 2))
    v, u = np.mgrid[:size, :size] + 0.5
    places = np.column_stack([u.ravel(), v.ravel()])
    distance, nearest = cKDTree(seeds).query(places, k=2)
    shade = random.uniform(90.0, 225.0, len(seeds))
    gray = shade[nearest[:, 0]] + 25.0 * random.standard_normal(size * size)
    gray = cv2.GaussianBlur(gray.reshape(size, size), (0, 0), 2.0)
    joint = (distance[:, 1] - distance[:, 0]).reshape(size, size) < size / 90.0
    return np.where(joint, 45.0, gray)


def _map(random: np.random.Generator, size: int) -> Array:
    """A town map: fields of several grays, houses, a river, and roads across them."""
    from scipy.spatial import cKDTree

    v, u = np.mgrid[:size, :size] / size
    fields = cKDTree(random.uniform(0.0, 1.0, (25, 2)))
    which = fields.query(np.column_stack([u.ravel(), v.ravel()]))[1].reshape(size, size)
    picture = random.uniform(150.0, 235.0, 25)[which]
    for _ in range(160):
        middle, half = random.uniform(0.0, 1.0, 2), random.uniform(0.006, 0.022, 2)
        angle = random.uniform(0.0, np.pi)
        along = (u - middle[0]) * np.cos(angle) + (v - middle[1]) * np.sin(angle)
        across = (v - middle[1]) * np.cos(angle) - (u - middle[0]) * np.sin(angle)
        house = (np.abs(along) < half[0]) & (np.abs(across) < half[1])
        picture[house] = random.uniform(30.0, 120.0)
    phase, start = random.uniform(0.0, 2.0 * np.pi), random.uniform(0.3, 0.7)
    river = start + 0.12 * np.sin(5.0 * v + phase) + 0.05 * np.sin(13.0 * v)
    picture[np.abs(u - river) < 0.03] = 80.0
    for _ in range(12):
        angle, middle = random.uniform(0.0, np.pi), random.uniform(0.1, 0.9, 2)
        off = np.abs((v - middle[1]) * np.cos(angle) - (u - middle[0]) * np.sin(angle))
        picture[off < 0.011] = 50.0
        picture[off < 0.007] = 255.0
    return picture


def _print(random: np.random.Generator, size: int) -> Array:
    """A printed label: lines of letters that no script has, headings, boxes and discs."""
    picture = np.full((size, size), 245.0)
    v, u = np.mgrid[:size, :size] / size
    top = 0.04
    while top < 0.93:
        heading = random.random() < 0.3
        cell = 0.016 if heading else 0.009
        left = 0.04
        while left < 0.94 - 5 * cell:
            letter = random.random((7, 5)) < 0.55
            for row, column in zip(*np.nonzero(letter), strict=True):
                a, b = (top + row * cell) * size, (left + column * cell) * size
                edge = cell * size
                picture[round(a) : round(a + edge), round(b) : round(b + edge)] = 25.0
            left += 6.0 * cell + (5.0 * cell if random.random() < 0.2 else 0.0)
        top += 9.5 * cell
    for _ in range(5):
        middle, radius = random.uniform(0.1, 0.9, 2), random.uniform(0.03, 0.08)
        off = np.hypot(u - middle[0], v - middle[1])
        picture[off < radius] = random.uniform(60.0, 200.0)
        picture[off < 0.4 * radius] = random.uniform(0.0, 255.0)
    return picture


TEXTURES: dict[str, Callable[[np.random.Generator, int], Array]] = {
    "stones": _stones,
    "map": _map,
    "print": _print,
}
"""Draws a texture from random numbers, `size` pixels along its edge, in grays from 0 to 255."""
