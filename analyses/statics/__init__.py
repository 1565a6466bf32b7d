"""Statics of a robot at one pose, and its modelling errors: numbers, and pictures of them.

* Queries at one pose: tensions, the pose of rest.
* Modelling errors: two models of the same robot beside each other, cables against rigid rods.

Pictures are imported when they are asked for, since that takes longer than the answers.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
