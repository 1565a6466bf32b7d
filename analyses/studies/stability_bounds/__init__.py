"""Study: stability workspaces sampled, searched, simulated and proven in three ways, with costs.

It is this project's own; the robots, the bounds of errors and the samples are those of the
servoing thesis, 3.3.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
