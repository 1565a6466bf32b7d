"""Tension distribution, and the management of tensions beside a visual servo.

**Distribution**: which tensions, with more cables than degrees of freedom? A problem is W t + w = 0
with lower <= t <= upper, W of shape (n, m), w the wrench of everything but the cables, (moment
[N m], force [N]). `METHODS` is the table of methods; a new one is a kernel and a row of it. A
solution's status is judged and never believed: feasible tensions balance the wrench within the
bounds, infeasible is a proof.

**Management**: a servo moves the platform to where the camera wants it, and nobody looks after the
tensions. The laws of `slack_correction` add to its cable velocities, negative ones shorten a cable.
They are pure functions of readings; `systems.controllers` has their block, `TensionCorrector`.

* `tension_correction`, (5.1): a cable below its threshold is wound up. The threshold is constant,
  grows with how short the cable is (`length_thresholds`), or comes from a tension distribution at
  the believed pose, which `TensionFollower` follows from both sides. The gain is constant or, by
  `adaptive_gains`, (5.3), proportional to what the cable is too long by. `tension_gain` is how
  large it may be, by stiffness, rate and delay.
* `length_correction`, (5.5): the cables of least tension are wound up to the length that the
  believed pose asks for.
* `polygon_correction`: tensions that leave the feasible polygon of the believed pose, or come near
  its edges, are brought back by velocities that change tensions and do not move the platform.

Source: Gazebo thesis 6.2; Zake, servoing thesis, 1.2.2, (1.27) with its minus sign, and 5.2; Pott,
2018. Different from print: (5.3) is clamped at zero, as a cable that is shorter than expected would
be paid out; its gain has another unit than that of (5.1) and another name here.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
