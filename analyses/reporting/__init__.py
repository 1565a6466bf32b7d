"""Where results go: folders, logs, tables, statements on what was published, provenance."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
