"""Where the numbers of a report come from: seed, versions and input files; folded, everything that the fit says."""

from bowdenfit.pages.section import Section, Table, prose
from bowdenfit.questions.summary.words import full_text
from bowdenfit.results.record import Record


def section(fit: Record) -> Section:
    """What it takes to make the same fit again."""
    made, files = fit.provenance, fit.dataset.sha256
    versions = ", ".join(f"{name} {version}" for name, version in made.versions.items())
    when = f", finished {made.created}" if made.created else ""
    return prose(
        "Where the numbers come from",
        [f"Seed {made.seed}{when}. The same files, versions and seed give the same numbers.", f"{versions}."],
        [Table(("input file", "SHA-256"), tuple(files.items()), left=(0, 1))],
        folded=[("Everything that the fit says", full_text(fit))],
    )
