from .answer import certify as certify
from .calibrated_cell import read_load_cell as read_load_cell
from .writing import write_certificate as write_certificate
