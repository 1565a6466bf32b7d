from .figures import FIGURES as FIGURES
from .study import CHECKS as CHECKS
from .study import study_stability_ranges as study_stability_ranges
