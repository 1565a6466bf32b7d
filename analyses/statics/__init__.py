"""Robots and mechanisms at rest, and the modelling errors of robots: numbers and pictures.

* `solve_static`: a robot or mechanism at rest, at a pose or with given lengths.
* Modelling errors: where a robot rests that is commanded by a wrong model of its cables.

Pictures are imported when they are asked for, since that takes longer than the answers.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
