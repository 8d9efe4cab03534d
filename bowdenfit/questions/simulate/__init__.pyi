from .recordings import make_recorded_data_set as make_recorded_data_set
from .tables import make_data_set as make_data_set
