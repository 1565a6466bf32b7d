"""Calibration of a robot from a log: reads what was measured, asks, reports, writes a robot file.

A log is text with columns that bear their names and units, see `read_log`. What comes out is a
robot file that scenarios take as `perturbations.believed_robot`, and all numbers as JSON.

Source: see `cdpr_drake.calibration`.

Identification of a robot's dynamics from a log: reads, asks, validates, reports, writes a robot.

A log is text with columns that bear their names and units, see `analyses.calibration.read_log`;
those that `cdpr simulate` writes are such. What comes out is a robot file that scenarios take as
what the controller believes, and all numbers as JSON.

Source: see `cdpr_drake.identification`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
