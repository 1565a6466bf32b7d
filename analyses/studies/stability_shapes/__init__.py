"""Study: shapes of the servoing thesis' control stability workspaces, drawn as the thesis does.

Source: servoing thesis 3.3, 3.4.2 and 4.3.1, figures 3.8, 3.10, 3.13, 3.15, 3.17, 3.20, 3.22, 3.25,
3.27, 3.32, 4.2.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
