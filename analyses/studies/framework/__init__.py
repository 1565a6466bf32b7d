"""What all studies share: cases that are run and continued, rows, statements, tables, figures.

A `Study` is the frame of all; `configuration_study` makes one whose cases are configurations of a
scenario, with figures and tables as a thesis has them. The studies themselves are beside this
package, in `analyses.studies`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
