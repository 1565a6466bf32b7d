from .statements import CHECKS as CHECKS
from .study import FIGURES as FIGURES
from .study import study_scenarios as study_scenarios
