"""Names of array types for functions that take arrays of two lengths at once; see `bowdenfit.types` for the others."""

from typing import TypeAlias

import numpy as np
from jaxtyping import Bool, Float, Int

OtherVector: TypeAlias = Float[np.ndarray, " other"]
OtherLabels: TypeAlias = Int[np.ndarray, " other"]
ChosenVector: TypeAlias = Float[np.ndarray, " chosen"]
ChosenFlags: TypeAlias = Bool[np.ndarray, " chosen"]
Positions: TypeAlias = Int[np.ndarray, " chosen"]
