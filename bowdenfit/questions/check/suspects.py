"""Influential readings that may be outliers, each predicted by a refit without it.

Importance weights cannot undo the effect of such a reading on the draws: how far out they place it differs between seeds. A
refit takes seconds, so it is made only for readings that look suspicious by their weights.
"""

from collections.abc import Sequence
from dataclasses import replace

import jax
import numpy as np

from bowdenfit.inference.draws import DrawFunction, compile_replicator
from bowdenfit.inference.leave_one_out import LooDensity, LooRefits
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.predictive_checks import replace_by_refit
from bowdenfit.questions.check.table_checks import TableChecks
from bowdenfit.results.record import Record, cached_per_fit

_SUSPICIOUS = 0.1  # expected number of readings of a healthy fit that are called suspicious: ten times that of outliers
_MAX_REFITS = 3  # refits at most; where more readings are far out, no single one of them is the cause


def refit_influential_outliers(fit: Record, tables: Sequence[TableChecks]) -> tuple[TableChecks, ...]:
    """Return the checks of all tables, with influential, suspicious readings predicted by refits without them.

    The prediction by weights stays where the refit does not converge.

    Args:
        fit: A fit with draws.
        tables: As importance weights predict them.
    """
    suspects = find_influential_outliers(tables)
    if not suspects:
        return tuple(tables)
    checked = list(tables)
    with jax.enable_x64(True):
        density, posterior, z = LogDensity(fit.model), fit.posterior, fit.posterior.flat_z
        log_likelihood = np.concatenate(
            [posterior.log_likelihood[term.name] for term in fit.model.terms], axis=-1
        ).reshape(len(z), -1)
        share = min(posterior.n_effective / len(z), 1.0)
        refits = LooRefits(LooDensity(density), z, log_likelihood, share, fit.provenance.seed)
        for table, row in suspects:
            checked[table] = _predict_by_refit(refits, replicate_program(fit), checked[table], row)
    return tuple(checked)


@cached_per_fit
def replicate_program(fit: Record) -> DrawFunction:
    """Return the compiled function from many z to replicated readings; a fit that samples has it already."""
    return fit.programs.quantities if fit.programs else compile_replicator(LogDensity(fit.model), fit.provenance.seed)


def find_influential_outliers(tables: Sequence[TableChecks]) -> list[tuple[int, int]]:
    """Return table and row number of every suspicious influential reading, the farthest out first."""
    n_readings = sum(len(table.p_values) for table in tables)
    p_values = {
        (number, row): p_value
        for number, table in enumerate(tables)
        for row, (p_value, influential) in enumerate(zip(table.p_values, table.influential, strict=True))
        if influential and p_value * n_readings < _SUSPICIOUS
    }
    return sorted(p_values, key=lambda suspect: p_values[suspect])[:_MAX_REFITS]


def _predict_by_refit(refits: LooRefits, replicate: DrawFunction, table: TableChecks, row: int) -> TableChecks:
    """Return the table with one of its readings predicted by a refit without it."""
    chain = refits.chain_without(refits.density.names.index((table.table, table.labels[0])) + row)
    if chain.reasons:
        return table
    replicated = replicate(chain.z.reshape(-1, chain.z.shape[-1]))["replicated"][table.table][:, row]
    reading, at_most = float(table.reading[row]), bool(table.at_most[row])
    predicted = replace_by_refit(table.predicted, row, replicated, reading, at_most)
    pit, refitted = table.pit.copy(), table.refitted.copy()
    pit[row] = np.clip(pit[row], predicted.below[row], predicted.up_to[row])
    refitted[row] = True
    return replace(table, predicted=predicted, pit=pit, refitted=refitted)
