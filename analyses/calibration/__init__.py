"""Calibration of a robot's geometry, and identification of its dynamics, from logs.

Both read a log, estimate parameters, report them, and write a robot file, and all numbers as JSON.
A log is text with columns that bear their names and units, see `read_log`.

* Calibration gives a robot file that scenarios take as `perturbations.believed_robot`.
* Identification also validates what it found. Logs that `cdpr simulate` writes can be its logs, and
  scenarios take its robot file as what the controller believes.

Source: see `cdpr_drake.calibration` and `cdpr_drake.identification`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
