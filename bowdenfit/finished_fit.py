"""`bf.Fit`: a finished fit as users hold it, with a method or attribute for every question, and the answers that it keeps."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol
from warnings import warn

from bowdenfit.arguments import Quantity, number_with_unit
from bowdenfit.display import Block, Rows, blocks_of
from bowdenfit.errors import UsageError, suggest_name
from bowdenfit.inference.interval import Interval
from bowdenfit.questions import identify
from bowdenfit.questions.bends.answer import ElasticAnswers, elastic_answers
from bowdenfit.questions.bends.words import elastic_blocks
from bowdenfit.questions.check.answer import Checks, check_readings
from bowdenfit.questions.check.words import check_sentences
from bowdenfit.questions.compare.answer import Comparison
from bowdenfit.questions.compare.words import comparison_blocks
from bowdenfit.questions.error_budget import (
    ErrorBudget,
    answer_interval,
    error_budget,
    find_optimal_length,
    with_bench_errors,
)
from bowdenfit.questions.figures import (
    FIGURES,
    collect_figure_data,
    draw_on_axes,
    draw_with_title,
    parse_page_size,
    parse_page_width,
    warning_mark,
)
from bowdenfit.questions.groups import Groups, contrast_groups
from bowdenfit.questions.identify.answer import Identifiability
from bowdenfit.questions.identify.judgment import assess_identifiability
from bowdenfit.questions.predict.predictions import prediction_blocks
from bowdenfit.questions.summary.brief import summary_blocks
from bowdenfit.questions.summary.details import posterior_intervals
from bowdenfit.questions.summary.latex import latex_table
from bowdenfit.questions.summary.page import Summary, summarize
from bowdenfit.questions.summary.verdict import Verdict, assess_fit
from bowdenfit.results.along_route import Efficiencies
from bowdenfit.results.answer_cache import COEFFICIENT_TROUBLES, TROUBLES
from bowdenfit.results.data_changes import find_data_changes
from bowdenfit.results.optimal_length import OptimalLength
from bowdenfit.results.record import Record
from bowdenfit.results.store import load as load_record
from bowdenfit.results.store import make_data_tree, save
from bowdenfit.words import listed

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import DataTree

    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.identify.likelihood import LikelihoodContour, ProfileLikelihood
import numpy as np

from bowdenfit.questions.predict.lengths import predict_at_lengths
from bowdenfit.results.serialization import serialize
from bowdenfit.stages import announce_stage


class Fit(Record):
    """A finished fit: its record, with the answers to every question; see `bowdenfit.results.record.Record`."""

    @classmethod
    def of(cls, record: Record) -> "Fit":
        """Return the fit that a record holds."""
        return cls(**{f.name: getattr(record, f.name) for f in fields(record) if f.init})

    @classmethod
    def load(cls, path: str | Path) -> "Fit":
        """Load a fit from its results folder, bit for bit as it was saved.

        Raises:
            StoreError: The folder is missing, unfinished or damaged.
        """
        announce_stage(f"reading {Path(path).name}")
        return cls.of(load_record(Path(path)))

    def save(self, path: str | Path, force: bool = False) -> None:
        """Write the results folder (without figures and summary text, which `bowdenfit.fit(output=...)` adds).

        Raises:
            StoreError: The folder holds a finished fit already, or cannot be written.
        """
        save(self, self.summary(), Path(path), force, answers=collect_answers(self))

    @cached_property
    def plot(self) -> "FigureMethods":
        """The figures, a method for each, such as `fit.plot.efficiency()`."""
        return FigureMethods(self)

    @property
    def elastic(self) -> ElasticAnswers:
        """Answers about stretch, preload and loops at wrap angles, from draws that include the errors of the bench."""
        return elastic_answers(with_bench_errors(self))

    @property
    def checks(self) -> Checks | None:
        """Every reading against its prediction from all the others, and what the priors do; None without draws."""
        return check_readings(self)

    @property
    def error_budget(self) -> ErrorBudget | None:
        """What usual errors of a bench, which its readings cannot show, add to each interval; None without draws."""
        return error_budget(self)

    @property
    def groups(self) -> Groups | None:
        """Groups of readings that have coefficients of their own, with their contrasts; None without such, or without draws."""
        return contrast_groups(self)

    @property
    def idata(self) -> "DataTree":
        """Draws, predictions and log-likelihoods as ArviZ takes them, with the groups and labels of posterior.nc.

        Raises:
            UsageError: The fit has no draws.
        """
        return make_data_tree(self)

    def parameter(self, name: str) -> Interval:
        """Return a parameter's value and interval, which includes the errors of the bench, in the unit in which it is shown.

        Raises:
            UsageError: There is no such parameter, or no posterior.
        """
        return answer_interval(self, name)

    def optimal_length(self) -> OptimalLength:
        """Return the best length, how certain it is with the errors of the bench, and what the choices cost.

        Raises:
            UsageError: The description has no route to vary, or there is no posterior.
        """
        return find_optimal_length(self)

    def efficiency(self, lengths: float | Iterable[float] | None = None) -> Efficiencies:
        """Return the efficiency at values of the route variable, with intervals that include the errors of the bench.

        Args:
            lengths: Route values; the description's choices if omitted.

        Raises:
            UsageError: There is no posterior, or a length is no number, or outside the range of the angle curves no wrap
                angle was measured at it.
        """
        return with_bench_errors(self).efficiency_of_draws(lengths)

    def correlation(self) -> "DataFrame":
        """Return the correlations of the draws of all parameters, as a square table.

        Raises:
            UsageError: The fit has no draws.
        """
        return self.posterior.to_frame()[[p.name for p in self.model.space.free]].corr()

    def profile(self, name: str) -> "ProfileLikelihood":
        """Return how -2 log L rises along one parameter, all others fitted again; its `plot()` is the figure.

        Raises:
            UsageError: There is no such free parameter, or it is a scale of noise.
        """
        return identify.profile_parameter(self, name)

    def contour(self, first: str, second: str) -> "LikelihoodContour":
        """Return how -2 log L rises over two parameters, all others fitted again; its `plot()` is the figure.

        Raises:
            UsageError: There is no such free parameter, one is a scale of noise, or both are the same.
        """
        return identify.contour_parameters(self, first, second)

    def summary(self) -> Summary:
        """Return everything on one page, for programs (the contents of summary.json)."""
        return Summary(summarize(self), partial(blocks_of, self))

    def to_latex(self) -> str:
        """Return the coefficients as a table of LaTeX, for a paper that uses the package booktabs."""
        return latex_table(self)

    def verdict(self) -> Verdict:
        """Return whether the answers may be trusted, and if not, why."""
        return assess_fit(self)

    @property
    def known(self) -> Identifiability:
        """What the draws determine, and what rests on the priors."""
        return assess_identifiability(self)

    def _table(self) -> Rows:
        """Return a row for each parameter: posterior beside least squares."""
        posterior, squares = posterior_intervals(self), self.least_squares.estimates
        rows = [
            {"parameter": p.name}
            | (vars(posterior[p.name]) if p.name in posterior else {})
            | ({"least_squares": squares[p.name].value} if p.name in squares else {})
            for p in self.model.space.parameters
        ]
        return rows, self._units


def load(path: str | Path) -> Fit:
    """Load a fit from its results folder, bit for bit as it was saved, and warn if its data have changed since.

    Raises:
        StoreError: The folder is missing, unfinished or damaged.
    """
    fit = Fit.load(path)
    if outdated := find_data_changes(Path(path)).describe(f"the fit {path}"):
        warn(outdated, stacklevel=2)
    return fit


class FigureMethods:
    """A method for each figure that a fit has something to show in, which gives the figure; `dir()` lists them.

    Figures are matplotlib's; pyplot does not know them, so that they are shown once and go when nobody holds them.

    Args:
        fit: The fit.
    """

    def __init__(self, fit: Record) -> None:
        self._fit = fit
        self._data: dict[str, Any] = {}  # of the figures asked for; None where there is nothing to show

    def __call__(
        self,
        name: str,
        width: Quantity | None = None,
        *,
        figsize: tuple[float, float] | None = None,
        ax: "Axes | Sequence[Axes] | np.ndarray | None" = None,
    ) -> "Figure":
        """Return one of the figures.

        Args:
            name: Which.
            width: On which words stay as large as they are, such as "3.5in"; what suits the figure if omitted.
            figsize: Width and height of the page [in], in place of `width`; panels are stretched to the height.
            ax: Axes of matplotlib that are drawn on in place of a page: one for the first panel alone, or one for each panel,
                row by row, as `plt.subplots` returns them. They keep their places; the figure that they belong to is returned.

        Raises:
            UsageError: The fit has no such figure, and which it has; none can be so wide or so low; or there are other than
                one axes or those of all panels.
        """
        if name not in FIGURES:
            raise NoSuchFigureError(f"there is no figure {name!r}{suggest_name(name, list(FIGURES))}")
        if self._data_of(name) is None:
            raise UsageError(f"this fit has nothing to show in the figure {name!r}; it has {listed(dir(self))}.")
        mark = warning_mark(assess_fit(self._fit).troubles)
        if sum(option is not None for option in (width, figsize, ax)) > 1:
            raise UsageError("give one of width, figsize and ax; the figure that ax belongs to has its own size.")
        if ax is not None:
            return draw_on_axes(name, self._data_of(name), ax, mark)
        if figsize is not None:
            inches, height = parse_page_size(figsize)
            return draw_with_title(name, self._data_of(name), self._fit.name, inches, mark, height)
        stated = None if width is None else number_with_unit("3.5in").read(width, "width")
        return draw_with_title(name, self._data_of(name), self._fit.name, parse_page_width(stated), mark)

    def __getattr__(self, name: str) -> "FigureMethod":
        if name.startswith("_"):
            raise AttributeError(name)
        if name not in FIGURES:
            raise NoSuchFigureError(f"there is no figure {name!r}{suggest_name(name, list(FIGURES))}")
        return partial(self, name)

    def __dir__(self) -> list[str]:
        return [name for name in FIGURES if self._data_of(name) is not None]

    def __repr__(self) -> str:
        return f"Figures of {self._fit.name}: {', '.join(f'plot.{name}()' for name in dir(self))}"

    def _data_of(self, name: str) -> Any:
        if name not in self._data:
            self._data[name] = dict(collect_figure_data(self._fit, [name])).get(name)
        return self._data[name]


class FigureMethod(Protocol):
    """One of the figures of a fit."""

    def __call__(
        self,
        width: Quantity | None = None,
        *,
        figsize: tuple[float, float] | None = None,
        ax: "Axes | Sequence[Axes] | np.ndarray | None" = None,
    ) -> "Figure":
        """Return the figure; see `FigureMethods.__call__`."""


class NoSuchFigureError(UsageError, AttributeError):
    """There is no figure of that name."""


def collect_answers(fit: Record) -> dict[str, Any]:
    """Return the answers that are kept in the results folder, as plain data by question.

    They are what verbs are asked most, where that needs no further physics; what a fit cannot answer is not among them.

    Args:
        fit: The fit.
    """
    verdict = assess_fit(fit)
    answers: dict[str, Any] = {
        TROUBLES: list(verdict.troubles), COEFFICIENT_TROUBLES: list(verdict.for_coefficients().troubles),
    }  # fmt: skip
    if fit.sampled is not None:
        answers["identify"] = serialize(vars(assess_identifiability(fit)))
        if (route := fit.dataset.description.route) is not None:
            answers["length"] = serialize(find_optimal_length(fit))
            if route.choices:
                rows = predict_at_lengths(with_bench_errors(fit), np.asarray(route.choices), None, "pull")
                answers["predict"] = [[length, serialize(row)] for length, row in zip(route.choices, rows, strict=True)]
    return answers


_BLOCKS: dict[type, Callable[..., Sequence[Block]]] = {
    Record: summary_blocks,
    Checks: check_sentences,
    ElasticAnswers: elastic_blocks,
    Efficiencies: lambda efficiencies: prediction_blocks(efficiencies.rows),
    Comparison: comparison_blocks,
}
for _result, _blocks in _BLOCKS.items():
    blocks_of.register(_result)(_blocks)
