from .figures import FIGURES as FIGURES
from .study import JUDGES as JUDGES
from .study import study_stability_ranges as study_stability_ranges
