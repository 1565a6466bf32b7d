"""What all case studies share: their definition, their runs in parallel, tables and figures.

A `CaseStudy` names configurations of scenarios and the judges of what a thesis states of them;
`run_case_study` runs them with several seeds and writes what they leave. A `SeededStudy` is the
frame of studies with runs of their own: configurations over seeds, continued, judged, written. The
studies themselves are beside this package, in `analyses.studies`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
