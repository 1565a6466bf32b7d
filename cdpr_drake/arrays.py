"""The array type of the signatures; shapes and units stand in the docstrings."""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
