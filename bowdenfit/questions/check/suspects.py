"""Readings that may be outliers of a fit that leans on them, each predicted by a fit without it.

Importance weights cannot take out what such a reading did to the draws: how far out they put it differs from seed to seed. A
fit takes seconds, so that only those that look suspicious by their weights are left out in this way.
"""

from collections.abc import Sequence
from dataclasses import replace

import jax
import numpy as np

from bowdenfit.inference.draws import DrawFunction, replicator
from bowdenfit.inference.leave_one_out import LooDensity, LooRefits
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.predictive_checks import replace_by_refit
from bowdenfit.questions.check.table_checks import TableChecks
from bowdenfit.results.record import Record, cached_per_fit

_SUSPICIOUS = 0.1  # chance that weights call one reading of a healthy fit so, ten times that of an outlier
_MOST = 3  # fits; where more readings are so far out, what is wrong is not one of them


def refit_suspects(fit: Record, tables: Sequence[TableChecks]) -> tuple[TableChecks, ...]:
    """Checks of all tables, with suspicious readings that the fit leans on predicted by fits without them.

    What weights say of a reading stays where the fit without it does not converge.

    Args:
        fit: A fit with draws.
        tables: As importance weights predict them.
    """
    suspects = suspects_of(tables)
    if not suspects:
        return tuple(tables)
    found = list(tables)
    with jax.enable_x64(True):
        density, drawn, z = LogDensity(fit.model), fit.posterior, fit.posterior.flat_z
        each = np.concatenate([drawn.log_likelihood[term.name] for term in fit.model.terms], axis=-1).reshape(len(z), -1)
        share = min(drawn.n_effective / len(z), 1.0)
        leaving_out = LooRefits(LooDensity(density), z, each, share, fit.provenance.seed)
        for at, place in suspects:
            found[at] = _refitted(leaving_out, implied_program(fit), found[at], place)
    return tuple(found)


@cached_per_fit
def implied_program(fit: Record) -> DrawFunction:
    """What many z imply for every reading; a fit that samples has it already."""
    return fit.programs.quantities if fit.programs else replicator(LogDensity(fit.model), fit.provenance.seed)


def suspects_of(tables: Sequence[TableChecks]) -> list[tuple[int, int]]:
    """Positions of the table and in it of every suspicious reading that the fit leans on, the farthest out first."""
    among = sum(len(table.chance) for table in tables)
    chances = {
        (at, place): chance
        for at, table in enumerate(tables)
        for place, (chance, decisive) in enumerate(zip(table.chance, table.decisive, strict=True))
        if decisive and chance * among < _SUSPICIOUS
    }
    return sorted(chances, key=lambda suspect: chances[suspect])[:_MOST]


def _refitted(leaving_out: LooRefits, implied: DrawFunction, table: TableChecks, place: int) -> TableChecks:
    """The table with one of its readings predicted by a fit without it."""
    chain = leaving_out.chain_without(leaving_out.density.names.index((table.table, table.labels[0])) + place)
    if chain.reasons:
        return table
    replicated = implied(chain.z.reshape(-1, chain.z.shape[-1]))["replicated"][table.table][:, place]
    reading, at_most = float(table.reading[place]), bool(table.at_most[place])
    predicted = replace_by_refit(table.predicted, place, replicated, reading, at_most)
    probability, refitted = table.probability.copy(), table.refitted.copy()
    probability[place] = np.clip(probability[place], predicted.below[place], predicted.up_to[place])
    refitted[place] = True
    return replace(table, predicted=predicted, probability=probability, refitted=refitted)
