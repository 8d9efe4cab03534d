"""Numbers of the on-body measurements that pages quote in sentences, from fits beside the published one.

`scripts/publish.py` writes them to `fits/published/on-body-exoskeleton/quoted.json`; `tests/support/quoted_sentences.py` says
in which sentences they stand, and holds the pages to them.
"""

import shutil
from pathlib import Path

import bowdenfit as bf

DATA = Path(__file__).resolve().parent.parent / "datasets" / "on-body-exoskeleton"


def numbers(published: bf.Fit, place: Path) -> dict[str, str]:
    """What the pages tell, as they write it.

    Args:
        published: The fit of the data set.
        place: Folder for changed copies of the data set.
    """
    again = {"seed": 1, "figures": False}
    without, mistaken = changed(place / "without", "efficiencies.csv"), changed(place / "mistaken", "angles.csv")
    fits = {
        "published": bf.fit(DATA, geometry="published", **again),
        "student": bf.fit(DATA, noise="student", **again),
        "without": bf.fit(without, **again),
        "mistaken": bf.fit(mistaken, **again),
        "mistaken_student": bf.fit(mistaken, noise="student", **again),
    }
    quoted = {"least_squares": str(bf.fit(DATA, mcmc=False, **again))}
    quoted |= {f"{name}_length": length(fit) for name, fit in fits.items()}
    quoted |= {f"{name}_mu3": span(fit, "mu3") for name, fit in {"plain": published, **fits}.items()}
    quoted |= {f"{name}_trusted": str(fit.verdict().trusted) for name, fit in fits.items()}
    quoted |= {f"without_{name}": share(fits["without"], name) for name in ("mu1", "mu2", "mu3")}
    compared = bf.compare({"continuous": published, "published": fits["published"]})
    return quoted | {"compared": str(compared).partition("\n\n")[0].replace("\n", " ")} | to_measure(published)


def changed(folder: Path, file: str) -> Path:
    """A copy of the data set without its efficiency at 550 mm, or with an angle of 28 degrees written as 82."""
    shutil.copytree(DATA, folder)
    rows = (DATA / file).read_text(encoding="utf-8").splitlines()
    rows = rows[:-1] if file == "efficiencies.csv" else [row.replace("480,17,28", "480,17,82") for row in rows]
    assert rows != (DATA / file).read_text(encoding="utf-8").splitlines()
    (folder / file).write_text("\n".join(rows) + "\n", encoding="utf-8")
    return folder


def length(fit: bf.Fit) -> str:
    """Best length with its interval and standard deviation [mm]."""
    best_length = fit.optimal_length().length
    return f"{best_length.median:.0f} mm ({best_length.q05:.0f} to {best_length.q95:.0f} mm; ± {best_length.sd:.1f} mm)"


def span(fit: bf.Fit, name: str) -> str:
    """Ends of an interval."""
    estimate = fit.parameter(name)
    return f"{estimate.q05:.3f} to {estimate.q95:.3f}"


def share(fit: bf.Fit, name: str) -> str:
    """Standard deviation of a coefficient in percent of it, by the readings alone, as `bowdenfit identify` gives it."""
    estimate = fit.parameter_of_draws(name)
    return f"{100 * estimate.sd / estimate.mean:.0f} %"


def to_measure(fit: bf.Fit) -> dict[str, str]:
    """What to measure next, for the best length and for mu3."""
    return {"next_length": str(bf.next_measurement(fit)), "next_mu3": str(bf.next_measurement(fit, "mu3"))}
