"""Names of array types; jaxtyping checks the shapes while testing, and costs nothing in use.

Only NumPy types live here, so that reading and checking tables never waits for JAX to load. Functions of JAX arrays
write `Float[Array, "..."]` themselves. `Other...` and `Chosen...` are for functions that take arrays of several lengths.
"""

from typing import Any, TypeAlias

import numpy as np
from jaxtyping import Bool, Float, Int

Vector: TypeAlias = Float[np.ndarray, " rows"]
Flags: TypeAlias = Bool[np.ndarray, " rows"]
Labels: TypeAlias = Int[np.ndarray, " rows"]
Matrix: TypeAlias = Float[np.ndarray, "rows columns"]
ChainDraws: TypeAlias = Float[np.ndarray, "chain draw"]
OtherVector: TypeAlias = Float[np.ndarray, " other"]
OtherFlags: TypeAlias = Bool[np.ndarray, " other"]
OtherLabels: TypeAlias = Int[np.ndarray, " other"]
ChosenVector: TypeAlias = Float[np.ndarray, " chosen"]
ChosenFlags: TypeAlias = Bool[np.ndarray, " chosen"]
Positions: TypeAlias = Int[np.ndarray, " chosen"]
# Array of a term's data: NumPy's or JAX's, or what stands in its place while JAX handles the data as a tree.
DataArray: TypeAlias = Any
