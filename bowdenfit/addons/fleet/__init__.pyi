from .fitting import FleetOptions as FleetOptions
from .fitting import fit_fleet as fit_fleet
from .inspections import read_inspections as read_inspections
