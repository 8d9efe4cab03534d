from .optimal_length import OptimalLength as OptimalLength
from .serialization import deserialize as deserialize
from .serialization import plain_data as plain_data
from .store import load as load
