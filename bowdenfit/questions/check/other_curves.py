"""Whether curves of another family follow the angles of a contact."""

import jax
import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.inference.lack_of_fit import FALSE_ALARM
from bowdenfit.inference.least_squares import fit_least_squares
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import make_objective
from bowdenfit.kinds.tables import AngleTable, Measurements
from bowdenfit.model import build_model


def curve_family_fits(dataset: Dataset, number: int, family: str) -> bool:
    """Return whether curves of another family follow the angles of a contact.

    Args:
        dataset: The data set.
        number: Number of the contact, from 0.
        family: The other family.
    """
    description = dataset.description
    contacts = list(description.contact)
    angle = contacts[number].wrap_angle
    contacts[number] = contacts[number].model_copy(update={"wrap_angle": angle.model_copy(update={"curve": family})})
    changed = description.model_copy(update={"contact": tuple(contacts)})
    table = dataset.measurements.table(AngleTable)
    with jax.enable_x64(True):
        posterior = LogDensity(build_model(Dataset(changed, Measurements((table,) if table else (), ()), {})))
        fit = fit_least_squares(
            posterior, make_objective(posterior), np.zeros(posterior.model.space.size), intervals=False
        )
    departures = [each for each in fit.departures if each.group == angle.column]
    return bool(departures) and all(each.p_value >= FALSE_ALARM for each in departures)
