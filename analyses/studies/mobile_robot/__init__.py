"""Study: a tag on a mobile robot that goes round, followed until that fails, or for three hours.

Every estimator of the platform's pose without a known tag (servoing thesis 2.3.7), and with a
known tag once a lap, without and with tension correction (5.3.1).
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
