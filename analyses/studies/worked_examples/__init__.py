"""Study: what the theses show on an example: a trajectory, polygons of tensions, what they cost.

Source: Gazebo thesis 6.2, figures 6.2 to 6.7; servoing thesis 1.3.4, figure 1.19.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
