from .coverage import cover as cover
from .figures import coverage_figure as coverage_figure
from .study import STUDY as STUDY
