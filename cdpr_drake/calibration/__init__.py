"""Which constants a robot has, from what was measured while it stood at some poses.

Unknown may be exit and anchor points, where winches begin to count and their drums' radii, pulleys,
the camera on the platform and tags that it sees. Measured are lengths, poses by a tracker, corners
of tags in images, swivel angles, tensions of a platform at rest. All that was measured enters over
its standard deviation; what is found is most likely, with its covariance, and what cannot be told
is named.

Poses and frames: W world, P platform, C camera, T tag. A pose steps by a rotation vector about the
axes of the frame that it stands in, then a translation. Readings of winches count from `start`.

Source: Triggs et al., Bundle adjustment, a modern synthesis, 2000; Borgstrom et al., NIMS-PL, a
cable-driven robot with self-calibration capabilities, 2009; Ida, Merlet, Carricato, Automatic
self-calibration of suspended under-actuated cable-driven parallel robot, 2019.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
