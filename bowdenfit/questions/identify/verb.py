"""What measurements determine: of a fit, of tables before sampling, or of a plan before anything is measured."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Unpack

from cyclopts import Parameter

from bowdenfit.arguments import PATH, Output, read_first
from bowdenfit.errors import DescriptionError
from bowdenfit.inputs import read_toml_file
from bowdenfit.questions.writing import files_of, write_answer
from bowdenfit.reading import Reading, read, refuse_named
from bowdenfit.verb import Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.dataset import Dataset
    from bowdenfit.questions.identify.answer import Identifiability
    from bowdenfit.results.record import Record

NAME = "identifiability"
NOT_IDENTIFIABLE = "not identifiable"  # what a fit is whose measurements do not tell every coefficient
_REACH, _PINS = 4.0, 21  # standard deviations on both sides that profiles cover, and values in them


@read_first
def identify(
    source: Annotated[
        "str | Path | Dataset | Record",
        Parameter("SOURCE", help="Such as fits/my-cable, the results of a fit, or my-cable, a data set."),
        PATH,
    ],
    *,
    output: Output = None,
    **reading: Unpack[Reading],
) -> "Identifiability":
    """What measurements determine of a cable's parameters, and what rests on the priors.

    Args:
        source: A fit or its results folder; a data set (fitted by least squares only); or a plan, a cable.toml with
            [design] (and [truth], where not given at the priors' medians), before anything is measured.
        output: Folder for identifiability.json, .txt and figures.
        reading: Keywords of `bowdenfit.read`, for a data set.

    Raises:
        BowdenfitError: What is wrong, in a sentence.
    """
    import jax

    from bowdenfit.questions.identify.words import identifiability_text

    with jax.enable_x64(True):
        found = _identify(source, reading)
    if output is not None:
        from bowdenfit.questions.identify import identifiability_figure

        write_answer(output, NAME, found, identifiability_text(found), {NAME: identifiability_figure}, found.name)
    return found


def _identify(source: "str | Path | Dataset | Record", reading: Reading) -> "Identifiability":
    from bowdenfit.dataset import Dataset
    from bowdenfit.results.record import Record
    from bowdenfit.results.store import load

    if isinstance(source, str | Path) and (Path(source) / "fit.json").exists():
        source = load(Path(source))
    if isinstance(source, Record):
        refuse_named(reading, f"{source.name} is a fit", "fit its data set again with that, or leave it out")
        return _of_fit(source)
    if isinstance(source, Dataset) or not _is_plan(Path(source)):
        return _of_tables(read(source, **reading))
    refuse_named(reading, "a plan is judged as it stands", "change the file instead")
    return _of_plan(Path(source))


def _is_plan(path: Path) -> bool:
    """Whether a file is a plan: a description with [design]."""
    if path.suffix.lower() != ".toml" or not path.is_file():
        return False
    try:
        return "design" in read_toml_file(path)[1]
    except DescriptionError:
        return False  # the reader says what is wrong


def _of_fit(found: "Record") -> "Identifiability":
    from bowdenfit.inference.least_squares import find_maximum_posterior
    from bowdenfit.inference.log_density import LogDensity
    from bowdenfit.inference.objective import make_objective
    from bowdenfit.questions.identify.judgment import identifiability

    known = identifiability(found)
    posterior = LogDensity(found.model)
    objective = make_objective(posterior)
    return replace(known, profiles=_profiles(posterior, objective, find_maximum_posterior(posterior, objective)))


def _profiles(posterior: Any, objective: Any, best: Any) -> tuple[Any, ...]:
    """Profiles of the friction coefficients, over four standard deviations on both sides."""
    import numpy as np

    from bowdenfit.inference.profiles import compute_profile

    space, sd = posterior.model.space, np.sqrt(np.diag(best.covariance))
    which = [i for i, p in enumerate(space.free) if p.role == "friction"]
    steps = np.linspace(-_REACH, _REACH, _PINS)
    return tuple(compute_profile(posterior, objective, space.free[i].name, best.z, z=best.z[i] + sd[i] * steps) for i in which)


def _of_tables(data: "Dataset") -> "Identifiability":
    from bowdenfit.dataset import DESCRIPTION_FILE
    from bowdenfit.inference.least_squares import find_maximum_posterior
    from bowdenfit.inference.log_density import LogDensity
    from bowdenfit.inference.objective import make_objective
    from bowdenfit.model import build_model
    from bowdenfit.questions.identify.judgment import of_maximum

    posterior = LogDensity(build_model(data))
    objective = make_objective(posterior)
    best = find_maximum_posterior(posterior, objective)
    basis = f"the best fit to the tables, with readings that scatter as {DESCRIPTION_FILE} expects"
    return of_maximum(posterior.model, best, basis, True, _profiles(posterior, objective, best))


def _of_plan(path: Path) -> "Identifiability":
    import jax
    import numpy as np

    from bowdenfit.dataset import Dataset
    from bowdenfit.inference.compilation import compile_program
    from bowdenfit.inference.least_squares import predict_posterior
    from bowdenfit.inference.log_density import LogDensity
    from bowdenfit.inference.scalar_priors import value_at
    from bowdenfit.model import build_model
    from bowdenfit.questions.identify.judgment import of_maximum
    from bowdenfit.questions.simulate.simulation import empty_tables, simulate, true_values
    from bowdenfit.questions.simulate.tables import read_bench

    plan = read_bench(path)
    tables = empty_tables(plan.description, plan.design)
    space = build_model(Dataset(plan.description, tables, {})).space
    medians = {p.name: value_at(p.prior, 0.0) * p.shown_scale for p in space.free}
    values = true_values(plan.description, tables, medians | dict(plan.truth), jax.random.key(0), once=True)
    data = simulate(plan.description, plan.design, values, jax.random.key(0), noise=False, once=True)
    posterior = LogDensity(build_model(data))
    assumed = "[truth]" if plan.truth else "the medians of the priors"
    basis = f"the plan, for a cable with the values of {assumed}; nothing has been measured"
    z = compile_program(posterior.model.space.unconstrain, values, run_once=True)(values)
    at = predict_posterior(posterior, np.asarray(z))
    return of_maximum(posterior.model, at, basis, False)


def _reply(found: "Identifiability", asked: dict[str, Any]) -> Reply:
    from bowdenfit.questions.identify.words import identifiability_text

    notes = tuple(f"Wrote {path}." for path in files_of(asked["output"], NAME)) if asked["output"] else ()
    return Reply(identifiability_text(found), lambda: found, notes, csv=found.to_csv)


def _kept(answers: Mapping[str, Any], asked: Mapping[str, Any]) -> Reply | None:
    """For people, who are not shown the profiles, which need the model."""
    if "identify" not in answers or any(value for name, value in asked.items() if name != "source"):
        return None
    from bowdenfit.inference.identifiability import CovarianceAnalysis
    from bowdenfit.questions.identify.answer import Identifiability
    from bowdenfit.questions.identify.words import identifiability_text
    from bowdenfit.results.serialization import deserialize

    page = answers["identify"]
    groups = deserialize(dict[str, CovarianceAnalysis], page["groups"])
    words = {"units": page["units"], "meanings": page["meanings"]}
    return Reply(identifiability_text(Identifiability(page["name"], page["basis"], page["measured"], groups, **words)))


VERB = Verb(
    identify,
    _reply,
    """Say which coefficients the measurements determine.

    SOURCE is a plan, before anything is measured (a cable.toml with [design], the
    lengths and forces that you intend to measure at, such as
    datasets/synthetic-bench/bench.toml); a data set; or the results folder of a
    fit. The answer says which friction coefficients, or which sums of them, SOURCE
    determines, how well, and which rest on the prior.
    """,
    csv="Print the parameters as CSV, one a row.",
    warns=True,
    explains=NOT_IDENTIFIABLE,
    kept=_kept,
)
