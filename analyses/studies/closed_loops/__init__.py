"""Closed loops from many poses of a stability workspace: does the criterion keep its promise?

Source: servoing thesis 3.3 and 3.4.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
