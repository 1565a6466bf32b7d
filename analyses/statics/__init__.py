"""Robots and mechanisms at rest, and the modelling errors of robots: numbers and pictures.

* `solve_static`: a robot or mechanism at rest, at a pose or with given lengths.
* Modelling errors: two models of the same robot compared, and cables with rigid rods.

Pictures are imported when they are asked for, since that takes longer than the answers.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
