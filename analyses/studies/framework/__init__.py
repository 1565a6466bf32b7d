"""The frame of every study: cases, rows of named columns, statements, tables.

A `Study` names its cases, what measures one, and what looks at the `Runs` that come of it;
`configuration_study` makes one whose cases are configurations of a scenario. The studies themselves
are beside this package, in `analyses.studies`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
