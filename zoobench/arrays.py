"""Types of arrays that every package shares."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Real numbers in double precision; the docstring beside it states shape and unit."""
