from .coverage import cover as cover
from .figures import FIGURES as FIGURES
from .figures import coverage_figure as coverage_figure
from .statements import CHECKS as CHECKS
from .study import study_tension_methods as study_tension_methods
