"""Logs of real machines: read as recorders write them, converted, joined, checked, replayed.

Readers by name (`LOG_READERS`) give a `RecordedLog`: columns with SI units in their headers, which
`cdpr calibrate` and `cdpr identify` read. `commanded_` stands before what the machine was told,
`estimated_` before what its controller believed. Nothing is guessed in silence: a log says which
reader read it and why, and who told each unit.

Sources: stand in the file of each format.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
