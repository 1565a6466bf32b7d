"""Study: the plant and the compiled engine beside each other, on all that ships and on draws.

`STUDY` runs both on every scenario, on taut motions of robots that are drawn, and on servos
with cables that go slack and catch; it measures orders of convergence, and the energy that impacts
put in or take out. The plant is the reference.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
