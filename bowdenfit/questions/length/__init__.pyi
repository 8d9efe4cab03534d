from .curves import curves_along_route as curves_along_route
from .curves import efficiency_points as efficiency_points
from .curves import new_run_interval as new_run_interval
from .curves import optimal_length_draws as optimal_length_draws
