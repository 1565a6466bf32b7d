from .statements import CHECKS as CHECKS
from .study import study_worked_examples as study_worked_examples
