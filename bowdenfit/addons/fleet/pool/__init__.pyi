from .figures import write_pool as write_pool
from .pooling import pool_results as pool_results
