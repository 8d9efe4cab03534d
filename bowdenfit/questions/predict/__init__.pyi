from .bends import make_query as make_query
from .bends import predict_at_wrap_angles as predict_at_wrap_angles
from .gait import make_gait as make_gait
from .gait import predict_over_gait as predict_over_gait
from .lengths import choose_route_values as choose_route_values
from .lengths import predict_at_lengths as predict_at_lengths
from .predictions import Predictions as Predictions
from .predictions import predictions_text as predictions_text
