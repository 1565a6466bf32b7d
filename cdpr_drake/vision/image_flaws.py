"""What spoils an image beside its lens: rows exposed one after the other, motion, defocus, noise.

An image is exposed at instants before it is complete. Each row has a span of them of its own: with
a rolling shutter later rows have later ones. What a row shows is the mean of pictures at instants
in its span, or the picture of the nearest instant where none lies in it. So an image is exact for
what a picture at each instant shows, up to half of `step` in time.

Source: Ait-Aider, Andreff, Lavest and Martinet, Simultaneous object pose and velocity computation
using a single view from a rolling shutter camera, ECCV 2006, for the shutter.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from cdpr_drake.arrays import Array

DARKEST, BRIGHTEST = 0.0, 255.0


@dataclass(frozen=True)
class ImageFlaws:
    """What spoils images.

    Attributes:
        noise: Standard deviation of every colour of a pixel, of 255 [-].
        defocus: Standard deviation of the blur of a lens out of focus [px].
        exposure: How long a row is exposed [s].
        readout: From the begin of the first row's exposure to that of the last row's; 0: all rows
            at once [s].
        renders: Pictures of which an image with exposure or readout is made.
    """

    noise: float = 0.0
    defocus: float = 0.0
    exposure: float = 0.0
    readout: float = 0.0
    renders: int = 8

    @property
    def moves(self) -> bool:
        """Whether an image has more than one instant."""
        return self.exposure > 0.0 or self.readout > 0.0

    @property
    def step(self) -> float:
        """Time between two pictures [s]."""
        return (self.exposure + self.readout) / self.renders

    @cached_property
    def instants(self) -> Array:
        """When the pictures are taken, from the time at which the image is complete, the earliest
        first, shape (n,) [s]; none is later than 0."""
        if not self.moves:
            return np.zeros(1)
        span = self.exposure + self.readout
        return np.asarray((np.arange(self.renders) + 0.5) * self.step - span, float)

    def shares(self, height: int) -> Array:
        """How much each row of an image has of each picture, shape (n, height) [-]; sums to 1."""
        ends = -self.readout * (1.0 - np.arange(height) / max(height - 1, 1))
        after = self.instants[:, np.newaxis] - (ends - 0.5 * self.exposure)
        inside = np.abs(after) <= 0.5 * self.exposure + 1e-9 * self.step
        nearest = np.abs(after) == np.min(np.abs(after), axis=0)
        chosen = np.where(np.any(inside, axis=0), inside, nearest).astype(float)
        return np.asarray(chosen / np.sum(chosen, axis=0))

    def expose(self, pictures: Array) -> np.ndarray:
        """The image of pictures at `instants`, shape (n, height, width, channels), 8 bits."""
        if len(pictures) == 1:
            return np.asarray(pictures[0])
        shares = self.shares(pictures.shape[1]).astype(np.float32)
        mixed = np.einsum("nr,nrcd->rcd", shares, pictures.astype(np.float32))
        return np.asarray(np.rint(mixed), np.uint8)

    def spoil(self, picture: np.ndarray, random: np.random.Generator) -> np.ndarray:
        """An image out of focus and with noise, of one without, shape (height, width, 4)."""
        if self.defocus > 0.0:
            picture = cv2.GaussianBlur(
                picture, (0, 0), self.defocus, borderType=cv2.BORDER_REPLICATE
            )
        if self.noise > 0.0:
            colours = picture[..., :3]
            values = colours + self.noise * random.standard_normal(colours.shape)
            picture = picture.copy()
            picture[..., :3] = np.clip(np.rint(values), DARKEST, BRIGHTEST)
        return picture
