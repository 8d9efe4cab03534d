from .curves import collect_angle_curves as collect_angle_curves
from .curves import collect_efficiency_points as collect_efficiency_points
from .curves import collect_optimal_lengths as collect_optimal_lengths
from .curves import compute_curves as compute_curves
from .curves import compute_new_run_interval as compute_new_run_interval
