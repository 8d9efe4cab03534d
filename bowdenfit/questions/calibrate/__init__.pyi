from .calibration import open_calibration as open_calibration
from .calibration import replicate_missing as replicate_missing
from .calibration import summarize_calibration as summarize_calibration
from .calibration import write_calibration as write_calibration
from .plan import list_quantities as list_quantities
from .plan import make_plan as make_plan
from .replications import read_seed as read_seed
