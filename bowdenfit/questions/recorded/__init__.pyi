from .friction_effects import collect_dependences as collect_dependences
from .traces import estimate_run_efficiencies as estimate_run_efficiencies
from .traces import trace_recordings as trace_recordings
