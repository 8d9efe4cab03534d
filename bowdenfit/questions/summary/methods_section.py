"""How a fit was made, as a paragraph that can be pasted into a paper, with its citations."""

import re
from pathlib import Path

from bowdenfit.kinds import each_table
from bowdenfit.pages.section import Section
from bowdenfit.questions.check.answer import checks_of
from bowdenfit.questions.summary.sampler_words import sampler_text
from bowdenfit.questions.summary.verdict import verdict
from bowdenfit.questions.summary.words import counts_in_words
from bowdenfit.results.record import Draws, Record
from bowdenfit.results.serialization import values_by_key

REFERENCES = {
    "capstan": "L. Euler, Remarques sur l'effet du frottement dans l'équilibre, Mémoires de l'académie des sciences de Berlin "
    "18 (1769), 265-278.",
    "emcee": "D. Foreman-Mackey, D. W. Hogg, D. Lang and J. Goodman, emcee: the MCMC hammer, Publications of the Astronomical "
    "Society of the Pacific 125 (2013), 306-312, doi:10.1086/670067.",
    "nuts": "M. D. Hoffman and A. Gelman, The No-U-Turn sampler: adaptively setting path lengths in Hamiltonian Monte Carlo, "
    "Journal of Machine Learning Research 15 (2014), 1593-1623.",
    "blackjax": "A. Cabezas, A. Corenflos, J. Lao and R. Louf, BlackJAX: composable Bayesian inference in JAX (2024), "
    "arXiv:2402.10797.",
    "r-hat": "A. Vehtari, A. Gelman, D. Simpson, B. Carpenter and P.-C. Bürkner, Rank-normalization, folding, and "
    "localization: an improved R-hat for assessing convergence of MCMC, Bayesian Analysis 16 (2021), 667-718, "
    "doi:10.1214/20-BA1221.",
    "nested": "C. C. Margossian, M. D. Hoffman, P. Sountsov, L. Riou-Durand, A. Vehtari and A. Gelman, Nested R-hat: assessing "
    "the convergence of Markov chain Monte Carlo when running many short chains, Bayesian Analysis 20 (2025), 1587-1614, "
    "doi:10.1214/24-BA1453.",
    "left-out": "A. Vehtari, A. Gelman and J. Gabry, Practical Bayesian model evaluation using leave-one-out cross-validation "
    "and WAIC, Statistics and Computing 27 (2017), 1413-1432, doi:10.1007/s11222-016-9696-4.",
    "optimistix": "J. Rader, T. Lyons and P. Kidger, Optimistix: modular optimisation in JAX and Equinox (2024), "
    "arXiv:2402.09983.",
    "jax": "J. Bradbury et al., JAX: composable transformations of Python+NumPy programs, version {jax}.",
    "arviz": "R. Kumar, C. Carroll, A. Hartikainen and O. Martin, ArviZ: a unified library for exploratory analysis of "
    "Bayesian models in Python, Journal of Open Source Software 4 (2019), 1143, doi:10.21105/joss.01143.",
}
_CITED = re.compile(rf"\[({'|'.join(REFERENCES)})\]")


def section(fit: Record) -> Section:
    """The paragraphs with numbers in place of the keys of `REFERENCES`, and the references by these numbers."""
    paragraphs = [" ".join(filter(None, [_data(fit), _model(fit), _inference(fit)])), _priors(fit)]
    keys = list(dict.fromkeys(_CITED.findall(paragraphs[0])))
    paragraphs[0] = _CITED.sub(lambda cited: f"[{keys.index(cited[1]) + 1}]", paragraphs[0])
    versions = fit.provenance.versions
    context = {
        "trusted": verdict(fit).trusted,
        "paragraphs": [p for p in paragraphs if p],
        "references": [REFERENCES[key].format(jax=versions.get("jax", "")) for key in keys],
    }
    return Section("Methods, to cite", Path(__file__).with_name("methods.html"), context)


def _data(fit: Record) -> str:
    version = fit.provenance.versions.get("bowdenfit", "")
    return f"{counts_in_words(fit)} of the cable were fitted jointly with bowdenfit {version}.".strip()


def _model(fit: Record) -> str:
    """Equations and scatter."""
    description = fit.dataset.description
    said = [
        "Friction at the contacts in series followed F_out = F_in exp(-s sum_k mu_k theta_k), with s = +1 while pulling and -1 "
        "while returning, friction coefficients mu_k and wrap angles theta_k [capstan]"
        + (f", and {description.laws_in_words}" if description.laws_in_words else "")
        + (f" (friction model {description.friction_model})" if description.friction_model != "capstan" else "")
        + (f"; {description.geometry} geometry" if description.curved else "")
        + ".",
        *(kind.methods_sentence for kind, _ in each_table(fit.dataset.measurements)),
        f"Readings scattered with {description.noise_in_words}.",
    ]
    return " ".join(dict.fromkeys(filter(None, said)))


def _inference(fit: Record) -> str:
    """How values and intervals came about."""
    squares = (
        "Least squares by Levenberg and Marquardt's method [optimistix], with profile intervals, on the same likelihood in JAX "
        "[jax]"
    )
    if fit.sampled is None:
        return f"Values are those of least squares: {squares[0].lower()}{squares[1:]}. No posterior was sampled."
    return " ".join([
        f"The joint posterior of {fit.model.space.size} parameters was sampled with {_sampler(fit.posterior)}.",
        _convergence(fit, fit.posterior),
        "Values are medians with central 90 % intervals. Each reading was held against its prediction from all the others by "
        f"Pareto-smoothed importance sampling [left-out]{_refitted(fit)}.",
        f"{squares}, served as a comparison. Diagnostics were computed with ArviZ [arviz]. All random numbers follow from the "
        f"seed {fit.provenance.seed}.",
    ])  # fmt: skip


def _refitted(fit: Record) -> str:
    """What more was done for readings of which the weights cannot tell."""
    found = checks_of(fit)
    n = sum(int(table.refitted.sum()) for table in found.tables) if found else 0
    return f", {n} of them against that of a fit without it" if n else ""


def _sampler(drawn: Draws) -> str:
    trajectories = values_by_key(drawn.trajectories) if drawn.trajectories else {}
    page = {"method": drawn.sampler, "ensembles": drawn.n_ensembles, "walkers": len(drawn.z) // drawn.n_ensembles}
    page |= {"steps": drawn.steps} | {key: value for key, value in trajectories.items() if key != "statistics"}
    words = sampler_text(page)
    return f"{words} [nuts] [blackjax]" if drawn.sampler == "nuts" else f"emcee [emcee], {words}"


def _convergence(fit: Record, drawn: Draws) -> str:
    settings = fit.dataset.description.sampler
    r_hat = "rank-normalized R-hat [r-hat]" if drawn.sampler == "nuts" else "rank-normalized, nested R-hat [r-hat] [nested]"
    limits = f"{r_hat} below {settings.target_r_hat:g} and effective sample sizes of at least {settings.target_ess}"
    if not fit.converged:
        return f"Convergence, which is {limits} for every parameter, was NOT reached."
    return f"It was sampled until every parameter had a {limits}."


def _priors(fit: Record) -> str:
    shown = "; ".join(f"{p.name} {p.prior_text}" for p in fit.model.space.free)
    return f"Priors: {shown}." if fit.sampled is not None and shown else ""
