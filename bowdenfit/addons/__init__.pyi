from bowdenfit.addons.metabolic.verbs import metabolic as metabolic
from bowdenfit.questions.compensate.verb import compensate as compensate
from bowdenfit.questions.fleet.verb import fleet as fleet
from bowdenfit.questions.pool.verb import pool as pool
from bowdenfit.questions.teleoperate.verb import teleoperate as teleoperate
