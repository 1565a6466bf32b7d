"""Study: every scenario that comes with the package, as it ships, beside what its file expects.

The full form takes each file as it stands, with rendered images where it says so; the quick form
projects targets and cuts what is long.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
