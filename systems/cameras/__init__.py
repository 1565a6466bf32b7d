"""Cameras as Drake blocks: rendered or projected, and the targets in front of them.

Every camera gives X_CO, found, and the target's marks, whether it detects them in an image, in a
window of it, or projects them. `TARGETS` is the table of kinds of targets.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
