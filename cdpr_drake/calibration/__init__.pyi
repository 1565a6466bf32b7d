from .program import CalibrationProgram as CalibrationProgram
from .result import CalibrationResult as CalibrationResult
