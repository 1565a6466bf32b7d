"""Mass, inertia, cable stiffness, damping and winch friction from logs of motions.

The wrench that a motion of a rigid platform asks for is linear in ten inertial parameters; cables
are longer than their winches count by what tension makes of them; motors lose what neither tension
nor acceleration explain. Each is an equation in one unknown vector. Logs are smoothed without phase
up to a bandwidth, and all equations are weighted by the noise that this leaves, which follows from
the log itself. `design_excitation` makes a motion that tells most. `fit_swings` predicts whole
swings on standing winches instead, and needs neither positions nor winches.

Frames and wrenches as in `geometry`; wrenches and accelerations are ordered (rotation,
translation). Lengths count positive when paid out, as in `winches`.

Source: Atkeson, An, Hollerbach, Estimation of inertial parameters of manipulator loads and links,
1986; Wensing, Kim, Slotine, Linear matrix inequalities for physically consistent inertial
parameter identification, 2018; Swevers et al., Optimal robot excitation and identification, 1997;
servoing thesis (2.6), (5.7).
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
