"""Long computations in pieces: in processes or on a cluster, stored as they come."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
