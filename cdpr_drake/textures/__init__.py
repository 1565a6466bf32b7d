"""Objects without tags: a textured plane, known by a picture of it, found in images as it is.

Its model is the picture: features of it find it anywhere in an image, and the whole picture, warped
and laid over the image, says where it is to hundredths of a pixel. `TexturedTarget` gives the
corners of the textured square, as if they were those of a tag, so that all servos and estimators
take them.

Sources: Lowe, Distinctive image features from scale-invariant keypoints, 2004; Fischler and Bolles,
RANSAC, 1981; Lucas and Kanade, 1981, by OpenCV; Baker and Matthews, Lucas-Kanade 20 years on, 2004.
"""

from cdpr_drake.textures.alignment import Alignment
from cdpr_drake.textures.drawn_images import drawn_image
from cdpr_drake.textures.pictures import TEXTURES, texture_picture
from cdpr_drake.textures.textured_target import TexturedTarget, TextureFinding

__all__ = [
    "TEXTURES", "Alignment", "TextureFinding", "TexturedTarget", "drawn_image", "texture_picture",
]  # fmt: skip
