"""The front desk: a fit as users hold it, which knows its folder and asks every question of its record."""

from dataclasses import fields
from pathlib import Path
from typing import Any

from bowdenfit.questions.bends.answer import Elastic, elastic_answers
from bowdenfit.questions.check.answer import Checks, checks_of
from bowdenfit.questions.groups.answer import Groups, groups_of
from bowdenfit.questions.identify.answer import Identifiability
from bowdenfit.questions.identify.judgment import identifiability
from bowdenfit.questions.kept import answers_of
from bowdenfit.questions.summary.html import fit_page
from bowdenfit.questions.summary.page import summarize
from bowdenfit.questions.summary.verdict import Verdict, verdict
from bowdenfit.results.record import Record
from bowdenfit.results.store import load as load_record
from bowdenfit.results.store import save


class Fit(Record):
    """A finished fit: its record, with the answers to every question; see `bowdenfit.results.record.Record`."""

    @classmethod
    def of(cls, record: Record) -> "Fit":
        """The fit of a record."""
        return cls(**{f.name: getattr(record, f.name) for f in fields(record) if f.init})

    @classmethod
    def load(cls, path: str | Path) -> "Fit":
        """A fit from its results folder, bit for bit as it was saved.

        Raises:
            StoreError: The folder is missing, unfinished or damaged.
        """
        return cls.of(load_record(Path(path)))

    def save(self, path: str | Path, force: bool = False) -> None:
        """Write the results folder (without figures and summary text, which `bowdenfit.fit(output=...)` adds).

        Raises:
            StoreError: The folder holds a finished fit already, or cannot be written.
        """
        save(self, self.summary(), Path(path), force, answers=answers_of(self))

    @property
    def elastic(self) -> Elastic:
        """Answers about stretch, preload and loops at wrap angles."""
        return elastic_answers(self)

    @property
    def checks(self) -> Checks | None:
        """Every reading against its prediction from all the others, and what the priors do; None without draws."""
        return checks_of(self)

    @property
    def groups(self) -> Groups | None:
        """Groups of readings that have coefficients of their own, with their contrasts; None without such, or without draws."""
        return groups_of(self)

    def summary(self) -> dict[str, Any]:
        """Everything on one page, for programs (the contents of summary.json)."""
        return summarize(self)

    def verdict(self) -> Verdict:
        """Whether the answers may be trusted, and if not, why."""
        return verdict(self)

    @property
    def known(self) -> Identifiability:
        """What the draws determine, and what rests on the priors."""
        return identifiability(self)

    def __repr__(self) -> str:
        state = "converged" if self.converged else "NOT converged" if self.posterior else "least squares only"
        return f"<bowdenfit.Fit {self.name!r}: {self.model.space.size} parameters, {state}>"

    def _repr_html_(self) -> str:
        return fit_page(self)


def load(path: str | Path) -> Fit:
    """A fit from its results folder, bit for bit as it was saved.

    Raises:
        StoreError: The folder is missing, unfinished or damaged.
    """
    return Fit.load(path)
