"""Study: schemes of visual servoing beside each other, from the same starts.

It compares image-based, pose-based, 2 1/2 D, partitioned and switching servoing: turns
about the optical axis and drawn starts of a camera that moves as it is told, and approaches of
ACROBOT with a wrong model. Servoing thesis 1.4.1 says of each what it is good for.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
