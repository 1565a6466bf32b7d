from .statements import JUDGES as JUDGES
from .study import FIGURES as FIGURES
from .study import study_scenarios as study_scenarios
