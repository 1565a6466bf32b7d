"""Where the robots that ship can work: static workspaces of the thesis, every kind, cross-checks.

Source: servoing thesis 1.3.3, figures 1.17 and 1.18; Gazebo thesis 2.6.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
