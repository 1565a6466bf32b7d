from .figures import FIGURES as FIGURES
from .statements import JUDGES as JUDGES
from .study import study_workspaces as study_workspaces
