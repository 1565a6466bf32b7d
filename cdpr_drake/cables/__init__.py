"""What a cable does when it is pulled: models by name, and the kernels behind them.

`CABLE_MODELS` is the table of models: straight or hanging, elastic or not, damped or not. A cable
only pulls; it is slack where it pulls nothing or, with weight, with no more than its own. Pull on
the platform, tension at the anchor and at the exit point, length, sag and their derivatives come
from one function, `cable_state`.

Source: servoing thesis (2.6); Irvine, Cable Structures, 1981, for sagging cables.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
