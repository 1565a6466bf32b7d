"""Visual servos as Drake blocks, their schemes and settings.

`SCHEMES` is the table of schemes: a new one is a class of features and a row of it.

Source: servoing thesis 1.4 and 4.2.

Control of cable tensions as Drake blocks: computed torque and distribution for dynamic control,
what takes up slack beside a visual servo, and visual servoing by torque.

Source: Gazebo thesis 6.1 and 6.2; servoing thesis 5.2.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
