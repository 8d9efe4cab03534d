from .fitting import fit_classically as fit_classically
from .fitting import fit_posterior as fit_posterior
from .preparing import choose_sampler as choose_sampler
from .preparing import choose_seed as choose_seed
from .preparing import start_checkpointing as start_checkpointing
from .writing import draw_results as draw_results
from .writing import save_results as save_results
