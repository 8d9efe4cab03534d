from bowdenfit.addons.certificate.verbs import cell as cell
from bowdenfit.addons.certificate.verbs import certificate as certificate
from bowdenfit.addons.device.compensate.verb import compensate as compensate
from bowdenfit.addons.device.teleoperate.verb import teleoperate as teleoperate
from bowdenfit.addons.fleet.pool.verb import pool as pool
from bowdenfit.addons.fleet.verbs import fleet as fleet
from bowdenfit.addons.metabolic.verbs import metabolic as metabolic
