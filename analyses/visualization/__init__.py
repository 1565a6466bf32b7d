"""Figures and pages that runs and studies share: style, cables, solids, the replay of a run."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
