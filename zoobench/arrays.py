"""Array types of all packages."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Real numbers in double precision; docstrings state shape and unit."""

Mask = NDArray[np.bool_]
"""Yes or no for every element."""
