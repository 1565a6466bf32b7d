"""Where a visual servo converges from, by many closed loops, beside what the criterion promises.

Source: this project; criterion, bounds and verdicts of the servoing thesis, chapter 3.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
