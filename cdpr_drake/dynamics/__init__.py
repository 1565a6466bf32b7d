"""The motion of a whole cable robot, platform, cables and winches, in compiled steps.

`advance_robot` integrates a robot that `pack_robot` made, many steps a call, explicitly or
semi-implicitly; forces, tensions and motors are those of `cables` and `winches`. `track` is a whole
loop of dynamic control in one call, with the laws of `control` and `tensions`. The state is
MultibodyPlant's of the platform, and behind it that of the winches. MultibodyPlant is the reference
to which this is compared.

Source: Featherstone, 2008, for the body; each kernel names its method.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
