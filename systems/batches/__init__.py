"""Many cable robots at once: states and parameters in arrays, moved by one compiled call.

`BatchRobots` has robots of one structure, each with its own points, stiffness, mass or friction,
and moves them on all cores by the kernels of the compiled engine, one robot as it moves alone, to
the last bit.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
