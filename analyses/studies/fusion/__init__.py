"""Study: two cameras, lengths, an IMU and depths fused, each failing or wrong in its turn.

Source: servoing thesis, perspectives: an onboard and an external camera, sensor fusion.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
