"""Runs of scenarios: simulation, numbers, figures and files.

* A kind of scenario is one class, such as `ServoRun`, whose object is a run from the scenario to
  the results folder, see `Run`. What steps it is an `Engine`: a diagram in Drake's simulator, or a
  loop without one.
* A subject of a run, such as contact or a sensor, is one `Subject`: its numbers and its figure.
* The log grows on disk, with checkpoints beside it, so whatever ends the program loses a few
  seconds of a run. A run that goes on comes to the same numbers as an uninterrupted one, bit for
  bit.
* Verbs: `simulate` and `finish_run`, `repeat_run` over seeds, `assess_run` for stability along a
  run.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
