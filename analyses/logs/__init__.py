"""Logs of real machines: read as recorders write them, joined, bound to a robot, replayed.

`read_log` reads a file in one of the `DIALECTS` into a `Log`: a table with SI units in its names,
and a ledger with a row for each column of the file: its unit and who said it, its name, or why it
was left out. `read_measurements` binds it to a robot, for every command alike.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
