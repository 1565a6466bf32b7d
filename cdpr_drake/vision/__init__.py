"""What a camera sees through its lens: targets, textures, cables; poses by images, also of tags.

Pixels are (u right, v down) from the centre of the first pixel; the camera frame C has z forward,
x right, y down.

**Targets.** A `Target` knows its points in its own frame O (x right, y up, z out of the pattern),
the marks that it leaves in an image, and how to get X_CO back from them.

**Textures**: objects without tags, a textured plane known by a picture of it, found in images as it
is. Its model is the picture: features of it find it anywhere in an image, and the whole picture,
warped and laid over the image, says where it is to hundredths of a pixel. `TexturedTarget` gives
the corners of the textured square, as if they were those of a tag, so that all servos and
estimators take them.

**Cables** as a camera in the world sees them: images of their curves, and slack read from those.
Image points are pixels (u, v), NaN where a point is not in the image. A cable hangs in the vertical
plane through its ends; surplus length is length less the distance of the ends [m].

Source: Olson, AprilTag, 2011; OpenCV for detection and pose from points; Lowe, Distinctive image
features from scale-invariant keypoints, 2004; Fischler and Bolles, RANSAC, 1981; Lucas and Kanade,
1981, by OpenCV; Baker and Matthews, Lucas-Kanade 20 years on, 2004; servoing thesis, perspectives
(slack seen by cameras); Irvine, Cable Structures, 1981, 1.1.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
