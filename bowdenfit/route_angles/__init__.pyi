from .points import measure_routes as measure_routes
from .turning import measure_polyline as measure_polyline
from .turning import measure_spline as measure_spline
