"""What a fit is refused for before it samples: coefficients that nothing tells apart, and draws that no memory holds."""

from collections.abc import Callable

import numpy as np

from bowdenfit.cable.registry import split_coefficient
from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError, UsageError
from bowdenfit.inference.identifiability import UNINFORMED, analyze_covariance
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.models import Model

_MOST_UNDETERMINED = 20  # judged: with fewer such combinations of coefficients a fit takes seconds, and says which they are
_MOST_STATES, _MOST_DRAWS = 4 << 30, 8 << 30  # bytes; judged: far more than a fit by default settings takes
_BYTES = 8  # of a number
_ARRAYS = 3  # that draws have for each reading: what is expected, what is drawn anew, and the log likelihood


def refuse_undetermined(model: Model, find_start: Callable[[], MaximumPosterior]) -> None:
    """Refuse coefficients of which the measurements leave many combinations to default priors.

    Args:
        model: The model.
        find_start: Returns the maximum of the posterior; it is not called where there are few coefficients.

    Raises:
        DescriptionError: There are too many.
    """
    names = [p.name for p in model.space.free if p.role == "friction" and not _is_stated(model.description, p.name)]
    if len(names) <= _MOST_UNDETERMINED:
        return
    which = [model.space.index[name] for name in names]
    start = find_start()
    analysis = analyze_covariance(names, start.z[which], start.covariance[np.ix_(which, which)], np.ones(len(which)))
    undetermined = sum(direction.share > UNINFORMED for direction in analysis.directions)
    if undetermined > _MOST_UNDETERMINED:
        raise DescriptionError(
            f"The measurements cannot separate the friction coefficients: of {len(names)} that are free, {undetermined} "
            "combinations would rest on their priors alone. Give contacts of the same materials one coefficient, state "
            "coefficients that are known under [friction.NAME], or add readings at other wrap angles; `bowdenfit identify` "
            "says what is determined."
        )


def _is_stated(description: Description, name: str) -> bool:
    """Return whether the description says something of a coefficient, or of the same one in every group."""
    return bool({name, split_coefficient(name, description.coefficients)[0]} & set(description.friction))


def refuse_large_sampling(model: Model) -> None:
    """Refuse settings of the sampler, and numbers of readings, whose draws would not fit into memory.

    Raises:
        UsageError: They would not.
    """
    settings, size = model.description.sampler, model.space.size
    if (states := settings.numbers_while_sampling(size) * _BYTES) > _MOST_STATES:
        raise UsageError(
            f"the states of the sampler may take {states / 1e9:,.1f} GB for {size} parameters, and at most "
            f"{_MOST_STATES / 1e9:.1f} GB are kept; lower sampler.max_steps, n_ensembles or n_walkers (n_chains of NUTS) in "
            'cable.toml, or choose method = "nuts", which needs fewer states where there are many parameters.'
        )
    draws, readings = settings.kept_draws(size), sum(len(term.labels) for term in model.terms)
    if (kept := draws * readings * _ARRAYS * _BYTES) > _MOST_DRAWS:
        raise UsageError(
            f"{draws:,} draws of {readings:,} readings take {kept / 1e9:,.1f} GB, and at most {_MOST_DRAWS / 1e9:.1f} GB are "
            "kept; average readings that were taken at the same place and load, fit what was sampled as a recording, or lower "
            "sampler.n_ensembles, n_walkers or target_ess in cable.toml."
        )
