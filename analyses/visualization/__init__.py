"""Pictures that runs and studies share: cables, paths, solids, robots in a browser, replays."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
