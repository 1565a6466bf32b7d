from .figures import FIGURES as FIGURES
from .statements import CHECKS as CHECKS
from .study import study_workspaces as study_workspaces
