"""Winches: what the drum holds, what the motor does, what friction takes.

Lengths are counted positive when paid out; torques and angles are those of the motor before the
gear unless a name says drum. A winch pulls on its cable with t = (R_g / r_w) times the motor's
torque.

Source: servoing thesis 2.3 and 5.2.3; friction after Coulomb, Stribeck and LuGre's static part.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
