"""The servoing thesis' control stability workspaces, computed again beside the printed ones.

Source: servoing thesis 3.3, tables A.8 to A.18.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
