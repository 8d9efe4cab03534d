"""What was measured, in the report."""

from bowdenfit.kinds import each_table
from bowdenfit.pages.section import Section, prose
from bowdenfit.questions.summary.words import fitted_to
from bowdenfit.results.record import Record


def section(fit: Record) -> Section:
    """Every table, as `bowdenfit check` has it."""
    data = fit.dataset
    described = [(kind, kind.describe(table, data.description)) for kind, table in each_table(data.measurements)]
    items = [line for kind, lines in described if not kind.heading for line in lines]
    longer = [(kind.heading, "\n".join(lines)) for kind, lines in described if kind.heading]
    return prose("What was measured", [fitted_to(fit), *data.measurements.remarks], items=items, folded=longer)
