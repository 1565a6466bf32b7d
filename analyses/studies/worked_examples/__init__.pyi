from .statements import JUDGES as JUDGES
from .study import study_worked_examples as study_worked_examples
