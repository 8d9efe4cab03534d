"""Residuals of least squares by groups of common scatter, after removing what parameters and mountings can follow."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bowdenfit.kinds.covariates import RUN, Covariates
from bowdenfit.kinds.sliding_rows import ORDER, STROKE, InsideRuns
from bowdenfit.kinds.term import Term
from bowdenfit.models import Model

_LEAST_FREEDOM = 0.5  # degrees of freedom below which the scatter of readings is not known
_SINGULAR = 1e-8  # relative singular value, and size of a residual, that counts as zero
_NOTHING_LEFT = 1e-300  # least efficiency, where rounding makes that of absurd coefficients zero
_LEAST_SCATTER = 1e-5  # relative to the expected scatter; readings that scatter less were not measured


@dataclass(frozen=True)
class ResidualGroup:
    """Readings with a common scatter.

    Args:
        table: Name of the readings.
        inside: Whether they are readings inside runs.
        rows: Their rows among all residuals.
        residuals: Standardized residuals.
        jacobian: Jacobian of the residuals.
        run_columns: Columns that the effects of mountings can follow.
        unit: Size of a residual of 1 in units of the reading.
        reading: The readings, to which a departure is relative; a loss as a log ratio.
        unused: Axis labels of columns that the fit does not use.
        effect: Part of the reading that is due to friction, where it is only a part; a departure is then relative to this.
        lever: Change of a reading by a relative change of friction.
        used: Which of them are readings, not bounds.
        group: Contact or other group of each; empty where there are no groups.
        at: Positions of the readings, by axis label.
        labels: Label of each; empty for readings inside runs.
        count: Number of independent readings.
        extra: Sum of squares inside cells of readings that were averaged.
        freedom: Remaining degrees of freedom.
        scatter: Standard deviation of the residuals, by which `ResidualGroups` divides them.
    """

    table: str
    inside: bool
    rows: slice
    residuals: np.ndarray
    jacobian: np.ndarray
    run_columns: np.ndarray
    unit: np.ndarray
    reading: np.ndarray
    lever: np.ndarray
    used: np.ndarray
    group: tuple[str, ...]
    at: Mapping[str, np.ndarray]
    count: float
    labels: tuple[str, ...] = ()
    extra: float = 0.0
    freedom: float = 0.0
    scatter: float = 1.0
    effect: np.ndarray | None = None
    unused: tuple[str, ...] = ()

    def excess(self, selected: np.ndarray) -> float:
        """Return by how much selected readings exceed the model, relative to the readings [1]."""
        read = np.abs(self.reading[selected])
        total = np.sum(read) or len(read) * np.mean(np.abs(self.reading))  # where nothing is read there, of all of them
        return float(np.sum((self.unit * self.residuals)[selected]) / total)


@dataclass(frozen=True)
class ResidualGroups:
    """All residuals, divided by the scatter of their table.

    Args:
        residuals: Residuals minus what parameters and mountings can follow.
        followed: Orthonormal columns that they can follow.
        readings: Groups that can be tested.
    """

    residuals: np.ndarray
    followed: np.ndarray
    readings: tuple[ResidualGroup, ...]


def group_residuals(model: Model, solution: Mapping[str, Any]) -> ResidualGroups:
    """Sort the residuals of least squares into groups of common scatter.

    Args:
        model: The model.
        solution: The minimum: residuals and expected readings by term, Jacobian, values; and `inside`, by term, what is added
            to residuals of readings inside runs, where errors of the bench are corrected.
    """
    return _weigh_by_scatter(_collect_blocks(model, solution))


@dataclass(frozen=True)
class ExplainedSquares:
    """What further parameters would explain of the residuals.

    Args:
        squares: Sum of squares that they explain, over the variance that remains.
        rank: How many of them readings can tell from the parameters of the model.
        freedom: Degrees of freedom of the variance (Satterthwaite), by what each table has of the sum.
        by_table: The explained residuals in units of the reading, and the readings, by table; labelled readings alone.
    """

    squares: float
    rank: int
    freedom: float
    by_table: Mapping[str, tuple[np.ndarray, np.ndarray]]


def explain_residuals(model: Model, solution: Mapping[str, Any], columns: np.ndarray) -> ExplainedSquares:
    """What residuals of all tables together further parameters explain, with scatters as they are with these.

    Args:
        model: The model.
        solution: As of `group_residuals`.
        columns: Derivatives of the residuals by further parameters, in the order of the Jacobian.
    """
    n = solution["jacobian"].shape[1]
    jacobian = np.zeros((len(solution["jacobian"]), n + columns.shape[1]))
    jacobian[:, :n], jacobian[: len(columns), n:] = solution["jacobian"], columns
    blocks = _collect_blocks(model, {**solution, "jacobian": jacobian})
    _weigh_by_scatter(blocks)
    residuals, followed = _project_out(blocks)
    without, of_model = _project_out([replace(block, jacobian=block.jacobian[:, :n]) for block in blocks])
    explained = without - residuals
    shares = np.array([np.sum(explained[block.rows] ** 2) for block in blocks])
    freedoms = np.array([max(block.count - float(np.sum(followed[block.rows] ** 2)), 0.0) for block in blocks])
    counts = (shares > 0) & (freedoms > _LEAST_FREEDOM)
    total, rank = float(shares.sum()), followed.shape[1] - of_model.shape[1]
    freedom = total**2 / float(np.sum(shares[counts] ** 2 / freedoms[counts])) if counts.any() else 0.0
    by_table = {
        block.table: (explained[block.rows] * block.unit * block.scatter, block.reading)
        for block in blocks
        if not block.inside and block.at
    }
    return ExplainedSquares(total, rank, freedom, by_table)


def _collect_blocks(model: Model, solution: Mapping[str, Any]) -> list[ResidualGroup]:
    """Groups of residuals, not yet weighed by their scatter."""
    values = {p.name: p.fixed or 0.0 for p in model.space.fixed}
    values |= dict(zip((p.name for p in model.space.free), solution["values"], strict=True))
    blocks, start, position = list[ResidualGroup](), 0, 0
    for term in model.terms:
        size = len(solution["residuals"][term.name])
        of_term = solution["residuals"][term.name], solution["jacobian"][position : position + size]
        position += size
        covariates = model.covariates.get(term.name)
        unused = tuple(covariates.unused) if covariates is not None else ()
        for block in _make_blocks(term, covariates, *of_term, solution["readings"][term.name], values):
            stop = start + len(block.residuals)
            if block.inside and "inside" in solution:
                block = replace(block, residuals=block.residuals + solution["inside"][term.name])
            blocks.append(replace(block, rows=slice(start, stop), unused=unused))
            start = stop
    return blocks


def _weigh_by_scatter(blocks: list[ResidualGroup]) -> ResidualGroups:
    """Divide the groups by their scatter, which needs the leverage of each residual first."""
    residuals, followed = _project_out(blocks)
    for i, block in enumerate(blocks):
        freedom = block.count - float(np.sum(followed[block.rows] ** 2))
        left = float(np.sum(residuals[block.rows] ** 2)) + block.extra
        if freedom > _LEAST_FREEDOM and left > 0:
            blocks[i] = replace(block, scatter=float(np.sqrt(left / freedom)), extra=block.extra * freedom / left)
    residuals, followed = _project_out(blocks)
    freedoms = [block.count - float(np.sum(followed[block.rows] ** 2)) for block in blocks]
    tested = (
        replace(block, freedom=freedom)
        for block, freedom in zip(blocks, freedoms, strict=True)
        if freedom > _LEAST_FREEDOM and block.scatter > _LEAST_SCATTER and block.at and np.any(block.reading)
    )
    return ResidualGroups(residuals, followed, tuple(tested))


def _project_out(blocks: list[ResidualGroup]) -> tuple[np.ndarray, np.ndarray]:
    """Return residuals minus what can be followed, and orthonormal columns of that."""
    residuals = np.concatenate([block.residuals / block.scatter for block in blocks])
    n_runs = sum(block.run_columns.shape[1] for block in blocks)
    columns = np.zeros((len(residuals), blocks[0].jacobian.shape[1] + n_runs))
    at = blocks[0].jacobian.shape[1]
    for block in blocks:
        columns[block.rows, : block.jacobian.shape[1]] = block.jacobian / block.scatter
        columns[block.rows, at : at + block.run_columns.shape[1]] = block.run_columns
        at += block.run_columns.shape[1]
    size = np.linalg.norm(columns, axis=0)
    u, s, _ = np.linalg.svd(columns[:, size > 0] / size[size > 0], full_matrices=False)
    followed = u[:, s > _SINGULAR]
    return residuals - followed @ (followed.T @ residuals), followed


def _make_blocks(
    term: Term,
    covariates: Covariates | None,
    residuals: np.ndarray,
    jacobian: np.ndarray,
    expected: np.ndarray,
    values: Mapping[str, float],
) -> Iterator[ResidualGroup]:
    """Yield the groups of a term: labelled readings first, then others, with positions only if they are inside runs."""
    first, *others = term.residual_blocks
    of_labels = _labelled_block(term, covariates, residuals[: first[0]], jacobian[: first[0]], expected)
    effect = getattr(term, "friction_effect", None)
    yield of_labels if effect is None else replace(of_labels, effect=np.asarray(effect(values)))
    start = first[0]
    for count, independent in others:
        rows = slice(start, start + count)
        inside = getattr(term, "inside", None)
        if inside is not None:
            yield _inside_run_block(term, inside, residuals[rows], jacobian[rows], values)
        else:
            yield _bare_block(term, residuals[rows], jacobian[rows], independent)
        start = rows.stop


def _bare_block(term: Term, residuals: np.ndarray, jacobian: np.ndarray, count: float) -> ResidualGroup:
    """Return residuals about which only their scatter is known."""
    n = len(residuals)
    nothing, none = np.zeros(n), np.zeros(n, dtype=bool)
    return ResidualGroup(
        term.name, False, slice(0), residuals, jacobian, np.zeros((n, 0)), nothing, nothing, nothing, none, ("",) * n, {}, count
    )  # fmt: skip


def _labelled_block(
    term: Term, covariates: Covariates | None, residuals: np.ndarray, jacobian: np.ndarray, expected: np.ndarray
) -> ResidualGroup:
    """Return the labelled readings, or whole runs."""
    n = len(residuals)
    bare = _bare_block(term, residuals, jacobian, float(np.count_nonzero(residuals)))
    observed = term.observed()
    if covariates is None or len(observed) < n or len(expected) != len(observed):
        return bare
    read, predicted = observed[:n], np.asarray(expected)[:n]
    if term.unit == "1":
        read, predicted = -np.log(read), -np.log(np.maximum(predicted, _NOTHING_LEFT))
    used = np.isfinite(read) & (np.abs(residuals) > _SINGULAR)
    unit = np.abs(np.divide(read - predicted, residuals, out=np.full(n, np.nan), where=used))
    unit = np.where(unit > 0, unit, np.nanmedian(unit[unit > 0]) if np.any(unit > 0) else 1.0)
    sign = np.sign(np.nansum((read - predicted) * residuals))
    reading = np.where(used, read, 0.0)
    numbers = {label: x[:n] for label, x in covariates.numbers.items() if label != RUN}  # which is their order
    unused = {heading: column.numbers[:n] for heading, column in covariates.unused.items()}
    back = {STROKE: covariates.back[:n].astype(float)}
    return replace(
        bare, unit=sign * unit, reading=reading, lever=np.ones(n), used=used, group=covariates.group[:n],
        at=unused | numbers | back | {ORDER: np.arange(float(n))}, count=float(used.sum()), labels=tuple(term.labels[:n]),
    )  # fmt: skip


def _inside_run_block(
    term: Any, inside: InsideRuns, residuals: np.ndarray, jacobian: np.ndarray, values: Mapping[str, float]
) -> ResidualGroup:
    """Return readings inside runs: each residual is that of its cell plus its deviation from the cell."""
    noise, root = float(values[term.reading_noise]), np.sqrt(inside.weight)
    share = root / np.sqrt(np.maximum(term.data.cells.weight[inside.cell], 1e-300))
    runs = inside.run[:, None] == np.unique(inside.run)[None, :]
    mean = np.bincount(inside.run, inside.weight * inside.log_ratio) / np.bincount(inside.run, inside.weight)
    n = len(root)
    return ResidualGroup(
        term.name, True, slice(0), share * residuals[inside.cell] + root * inside.apart / noise,
        share[:, None] * jacobian[inside.cell], runs * root[:, None], noise / root, inside.log_ratio,
        np.abs(mean[inside.run]), np.ones(n, dtype=bool), ("",) * n, inside.at, inside.count,
        extra=inside.within / noise**2,
    )  # fmt: skip
