"""What measurements determine: of a fit, of tables before sampling, or of a plan before anything is measured."""

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bowdenfit.dataset import DESCRIPTION_FILE, Dataset
from bowdenfit.errors import UsageError
from bowdenfit.verbs import load, read

if TYPE_CHECKING:
    from bowdenfit.questions.identify.answer import Identifiability
    from bowdenfit.results.record import Record

_REACH, _PINS = 4.0, 21  # standard deviations on both sides that profiles cover, and values in them


def identify(source: "str | Path | Dataset | Record", **reading: Any) -> "Identifiability":
    """What measurements determine of a cable's parameters, and what rests on the priors.

    Args:
        source: A fit or its results folder; a data set (fitted by least squares only); or a plan, a cable.toml with
            [design] (and [truth], where not given at the priors' medians), before anything is measured.
        reading: Keywords of `bowdenfit.read`, for a data set.

    Raises:
        BowdenfitError: What is wrong, in a sentence.
    """
    import jax

    from bowdenfit.results.record import Record

    if isinstance(source, str | Path) and (Path(source) / "fit.json").exists():
        source = load(source)
    with jax.enable_x64(True):
        if isinstance(source, Record):
            return _of_fit(source)
        if isinstance(source, Dataset) or not _is_plan(Path(source)):
            return _of_tables(read(source, **reading))
        if any(reading.values()):
            raise UsageError("a plan is judged as it stands; change the file instead of naming options.")
        return _of_plan(Path(source))


def _is_plan(path: Path) -> bool:
    """Whether a file is a plan: a description with [design]."""
    if path.suffix != ".toml" or not path.is_file():
        return False
    try:
        return "design" in tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
        return False  # the reader says what is wrong


def _of_fit(found: "Record") -> "Identifiability":
    from bowdenfit.inference.least_squares import make_objective, maximum_posterior
    from bowdenfit.inference.log_density import LogDensity
    from bowdenfit.questions.identify.answer import identifiability

    known = identifiability(found)
    posterior = LogDensity(found.model)
    objective = make_objective(posterior)
    return replace(known, profiles=_profiles(posterior, objective, maximum_posterior(posterior, objective)))


def _profiles(posterior: Any, objective: Any, best: Any) -> tuple[Any, ...]:
    """Profiles of the friction coefficients, over four standard deviations on both sides."""
    import numpy as np

    from bowdenfit.inference.profiles import profile

    space, sd = posterior.model.space, np.sqrt(np.diag(best.covariance))
    which = [i for i, p in enumerate(space.free) if p.role == "friction"]
    steps = np.linspace(-_REACH, _REACH, _PINS)
    return tuple(profile(posterior, objective, space.free[i].name, best.z, z=best.z[i] + sd[i] * steps) for i in which)


def _of_tables(data: Dataset) -> "Identifiability":
    from bowdenfit.inference.least_squares import make_objective, maximum_posterior
    from bowdenfit.inference.log_density import LogDensity
    from bowdenfit.model import build_model
    from bowdenfit.questions.identify.answer import of_maximum

    posterior = LogDensity(build_model(data))
    objective = make_objective(posterior)
    best = maximum_posterior(posterior, objective)
    basis = f"the best fit to the tables, with readings that scatter as {DESCRIPTION_FILE} expects"
    return of_maximum(posterior.model, best, basis, True, _profiles(posterior, objective, best))


def _of_plan(path: Path) -> "Identifiability":
    import jax
    import numpy as np

    from bowdenfit.inference.identifiability import information_at
    from bowdenfit.inference.log_density import LogDensity
    from bowdenfit.model import build_model
    from bowdenfit.questions.identify.answer import of_maximum
    from bowdenfit.questions.simulate.simulation import empty_tables, simulate, true_values
    from bowdenfit.questions.simulate.tables import read_bench

    plan = read_bench(path)
    tables = empty_tables(plan.description, plan.design)
    space = build_model(Dataset(plan.description, tables, {})).space
    medians = {p.name: float(np.asarray(p.prior.constrain(np.zeros(1)))[0]) * p.shown_scale for p in space.free}
    values = true_values(plan.description, tables, medians | dict(plan.truth), jax.random.key(0))
    data = simulate(plan.description, plan.design, values, jax.random.key(0), noise=False)
    posterior = LogDensity(build_model(data))
    assumed = "[truth]" if plan.truth else "the medians of the priors"
    basis = f"the plan, for a cable with the values of {assumed}; nothing has been measured"
    at = information_at(posterior, np.asarray(posterior.model.space.unconstrain(values)))
    return of_maximum(posterior.model, at, basis, False)


def write(found: "Identifiability", folder: Path) -> list[Path]:
    """Write identifiability.json, identifiability.txt and the figure.

    Args:
        found: What is known.
        folder: Where to; made if missing. Earlier files of these names are replaced.

    Returns:
        The files written.

    Raises:
        StoreError: The folder cannot be written.
    """
    import json

    from bowdenfit.plots.write import FORMATS
    from bowdenfit.plots.write import write as write_figure
    from bowdenfit.questions.identify.figure import identifiability
    from bowdenfit.questions.identify.words import identifiability_text
    from bowdenfit.results.folder import made, write_text

    with made(folder):
        write_text(folder / "identifiability.json", json.dumps(found.page(), indent=1) + "\n")
        write_text(folder / "identifiability.txt", identifiability_text(found))
        figure = identifiability(found.groups, found.profiles)
        drawn = [write_figure(figure, folder / f"identifiability.{ending}") for ending in FORMATS]
    return [folder / "identifiability.json", folder / "identifiability.txt", *drawn]
