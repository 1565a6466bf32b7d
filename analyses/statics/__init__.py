"""Two models of the same robot beside each other: modelling errors, cables against rigid rods.

Questions about a robot at one pose: tensions, rest; numbers, and pictures of them.

Pictures are imported when they are asked for, since that takes longer than the answers.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
