"""`bf.Fit`: a finished fit as users hold it, with a method or attribute for every question."""

from collections.abc import Callable
from dataclasses import fields
from functools import cached_property
from pathlib import Path

from bowdenfit.display import Rows, text_of
from bowdenfit.questions.bends.answer import ElasticAnswers, elastic_answers
from bowdenfit.questions.bends.words import bends_text
from bowdenfit.questions.check.answer import Checks, checks_of
from bowdenfit.questions.check.words import checks_page
from bowdenfit.questions.figure_methods import FigureMethods
from bowdenfit.questions.groups import Groups, contrast_groups
from bowdenfit.questions.identify.answer import Identifiability, identifiability_text
from bowdenfit.questions.identify.judgment import assess_identifiability
from bowdenfit.questions.predict.predictions import predictions_text
from bowdenfit.questions.stored_answers import collect_answers
from bowdenfit.questions.summary.brief import summary_text
from bowdenfit.questions.summary.details import posterior_intervals
from bowdenfit.questions.summary.page import Summary, summarize
from bowdenfit.questions.summary.verdict import Verdict, assess_fit, verdict_text
from bowdenfit.results.along_route import Efficiencies
from bowdenfit.results.record import Record
from bowdenfit.results.store import load as load_record
from bowdenfit.results.store import save


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
        return cls.of(load_record(Path(path)))

    def save(self, path: str | Path, force: bool = False) -> None:
        """Write the results folder (without figures and summary text, which `bowdenfit.fit(output=...)` adds).

        Raises:
            StoreError: The folder holds a finished fit already, or cannot be written.
        """
        save(self, self.summary(), Path(path), force, answers=collect_answers(self))

    @cached_property
    def plot(self) -> FigureMethods:
        """The figures, a method for each, such as `fit.plot.efficiency()`."""
        return FigureMethods(self)

    @property
    def elastic(self) -> ElasticAnswers:
        """Answers about stretch, preload and loops at wrap angles."""
        return elastic_answers(self)

    @property
    def checks(self) -> Checks | None:
        """Every reading against its prediction from all the others, and what the priors do; None without draws."""
        return checks_of(self)

    @property
    def groups(self) -> Groups | None:
        """Groups of readings that have coefficients of their own, with their contrasts; None without such, or without draws."""
        return contrast_groups(self)

    def summary(self) -> Summary:
        """Return everything on one page, for programs (the contents of summary.json)."""
        return Summary(summarize(self), self.__str__)

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
    """Load a fit from its results folder, bit for bit as it was saved.

    Raises:
        StoreError: The folder is missing, unfinished or damaged.
    """
    return Fit.load(path)


_WORDS: dict[type, Callable[..., str]] = {
    Record: summary_text,
    Verdict: verdict_text,
    Checks: checks_page,
    ElasticAnswers: bends_text,
    Identifiability: identifiability_text,
    Efficiencies: lambda efficiencies: predictions_text(efficiencies.rows),
}
for _result, _words in _WORDS.items():
    text_of.register(_result)(_words)
