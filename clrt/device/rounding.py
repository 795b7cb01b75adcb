"""Numbers rounded to where a bound stays one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def rounded_down(values: NDArray[np.float64], real: type[np.floating]) -> NDArray[Any]:
    """The greatest number of type `real` that is not greater."""
    rounded = values.astype(real)
    return np.where(rounded > values, np.nextafter(rounded, real(-np.inf)), rounded)


def rounded_up(values: NDArray[np.float64], real: type[np.floating]) -> NDArray[Any]:
    """The least number of type `real` that is not less."""
    return -rounded_down(-values, real)
