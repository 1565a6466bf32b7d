"""Free motion of a platform on standing winches: the mathematics of `identify_swings`.

`fit_free_motion` predicts stretches of a log of a swing from their first states, by a robot whose
dynamics, sensors and cables have unknown parameters, and finds these.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
