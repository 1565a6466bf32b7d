"""Sections of scenarios, a folder each: settings, blocks, columns of the log, numbers and figures.

`systems.sections` lists them and says what a section is. `section.py` has the settings, whose hooks
the core calls; `report.py` what a run shows of it. No other file of the core names one.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
