"""Fits of robots and cameras to measurements: geometry, dynamics, swings, lenses.

Each is a verb that gives a `Fit`, which writes a file of what it found, and all numbers as JSON.

* `calibration.calibrate` gives a robot file that scenarios take as
  `perturbations.believed_robot`.
* `campaign.calibrate_campaign` shows the same in simulation, with the robot of a scenario.

Source: see `cdpr_drake.calibration` and `cdpr_drake.identification`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
