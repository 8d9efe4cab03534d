"""How a fit was made, as a paragraph that can be pasted into a paper, with its citations."""

import re
from pathlib import Path
from typing import Any

from bowdenfit.kinds import iterate_tables
from bowdenfit.kinds.terms import find_term_kind
from bowdenfit.pages.section import PageSection
from bowdenfit.questions.check.answer import check_readings
from bowdenfit.questions.summary.verdict import assess_fit
from bowdenfit.results.record import Draws, Record
from bowdenfit.results.serialization import values_by_key
from bowdenfit.words import listed

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
    "psis": "A. Vehtari, D. Simpson, A. Gelman, Y. Yao and J. Gabry, Pareto smoothed importance sampling, Journal of Machine "
    "Learning Research 25 (2024), 1-58.",
    "optimistix": "J. Rader, T. Lyons and P. Kidger, Optimistix: modular optimisation in JAX and Equinox (2024), "
    "arXiv:2402.09983.",
    "jax": "J. Bradbury et al., JAX: composable transformations of Python+NumPy programs, version {jax}.",
    "arviz": "R. Kumar, C. Carroll, A. Hartikainen and O. Martin, ArviZ: a unified library for exploratory analysis of "
    "Bayesian models in Python, Journal of Open Source Software 4 (2019), 1143, doi:10.21105/joss.01143.",
}
_CITED = re.compile(rf"\[({'|'.join(REFERENCES)})\]")


def methods_section(fit: Record) -> PageSection:
    """Return the paragraphs with numbers in place of the keys of `REFERENCES`, and the references by these numbers."""
    paragraphs = [
        " ".join(filter(None, [_data_sentence(fit), _model_sentences(fit), _inference_sentences(fit)])),
        _prior_sentence(fit),
    ]
    keys = list(dict.fromkeys(_CITED.findall(paragraphs[0])))
    paragraphs[0] = _CITED.sub(lambda cited: f"[{keys.index(cited[1]) + 1}]", paragraphs[0])
    versions = fit.provenance.versions
    context = {
        "trusted": assess_fit(fit).trusted,
        "paragraphs": [p for p in paragraphs if p],
        "references": [REFERENCES[key].format(jax=versions.get("jax", "")) for key in keys],
    }
    return PageSection("Methods, to cite", Path(__file__).with_name("methods.html"), context)


def describe_counts(fit: Record) -> str:
    """Describe what was fitted to: '17 wrap angles and 4 efficiencies'."""
    description, tables = fit.dataset.description, fit.dataset.measurements
    entered = [find_term_kind(term.name).count_readings(term, description) for term in fit.model.terms]
    read = [kind.count_readings(table) for kind, table in iterate_tables(tables)]
    return listed([count for count in (*entered, *read) if count])


def describe_fitted_data(fit: Record) -> str:
    """Describe what was fitted to, and by which model where it is not the usual one."""
    description = fit.dataset.description
    geometry = f"; {description.geometry} geometry" if description.curved else ""
    model = f"; friction model {description.friction_model}" if description.friction_model != "capstan" else ""
    laws = f"; {description.laws_in_words}" if description.laws_in_words else ""
    noise = f"; {description.noise_in_words}" if description.noise != "normal" else ""
    return f"Fitted to {describe_counts(fit)}{geometry}{laws}{model}{noise}."


def _data_sentence(fit: Record) -> str:
    """Say what was fitted, by which version."""
    version = fit.provenance.versions.get("bowdenfit", "")
    return f"{describe_counts(fit)} of the cable were fitted jointly with bowdenfit {version}.".strip()


def _model_sentences(fit: Record) -> str:
    """Describe equations and scatter."""
    description = fit.dataset.description
    sentences = [
        "Friction at the contacts in series followed F_out = F_in exp(-s sum_k mu_k theta_k), with s = +1 while pulling and -1 "
        "while returning, friction coefficients mu_k and wrap angles theta_k [capstan]"
        + (f", and {description.laws_in_words}" if description.laws_in_words else "")
        + (f" (friction model {description.friction_model})" if description.friction_model != "capstan" else "")
        + (f"; {description.geometry} geometry" if description.curved else "")
        + ".",
        *(kind.methods_sentence for kind, _ in iterate_tables(fit.dataset.measurements)),
        f"Readings scattered with {description.noise_in_words}.",
    ]
    return " ".join(dict.fromkeys(filter(None, sentences)))


def _inference_sentences(fit: Record) -> str:
    """Describe how values and intervals were computed."""
    squares = (
        "Least squares by Levenberg and Marquardt's method [optimistix], with profile intervals, on the same likelihood in JAX "
        "[jax]"
    )
    if fit.sampled is None:
        return f"Values are those of least squares: {squares[0].lower()}{squares[1:]}. No posterior was sampled."
    return " ".join([
        f"The joint posterior of {fit.model.space.size} parameters was sampled with {_sampler_phrase(fit.posterior)}.",
        _convergence_sentence(fit, fit.posterior),
        "Values are medians with central 90 % intervals. Each reading was held against its prediction from all the others by "
        f"Pareto-smoothed importance sampling [left-out]{_refitted_phrase(fit)}.",
        f"{squares}, served as a comparison. Diagnostics were computed with ArviZ [arviz]. All random numbers follow from the "
        f"seed {fit.provenance.seed}.",
    ])  # fmt: skip


def _refitted_phrase(fit: Record) -> str:
    """Describe the refits for readings that importance weights cannot leave out."""
    checks = check_readings(fit)
    n = sum(int(table.refitted.sum()) for table in checks.tables) if checks else 0
    return f", {n} of them against that of a fit without it" if n else ""


def _sampler_phrase(posterior: Draws) -> str:
    """Describe the sampler with its citations."""
    trajectories = values_by_key(posterior.trajectories) if posterior.trajectories else {}
    page = {
        "method": posterior.sampler,
        "ensembles": posterior.n_ensembles,
        "walkers": len(posterior.z) // posterior.n_ensembles,
    }
    page |= {"steps": posterior.steps, "pareto_k": posterior.pareto_k}
    page |= {key: value for key, value in trajectories.items() if key != "statistics"}
    words = sampler_text(page)
    cited = {"nuts": f"{words} [nuts] [blackjax]", "importance": f"{words} [psis]"}
    return cited.get(posterior.sampler, f"emcee [emcee], {words}")


def _convergence_sentence(fit: Record, posterior: Draws) -> str:
    """Say which limits of convergence were reached."""
    settings = fit.dataset.description.sampler
    nested = posterior.sampler == "emcee"
    r_hat = "rank-normalized, nested R-hat [r-hat] [nested]" if nested else "rank-normalized R-hat [r-hat]"
    limits = f"{r_hat} below {settings.target_r_hat:g} and effective sample sizes of at least {settings.target_ess}"
    if not fit.converged:
        return f"Convergence, which is {limits} for every parameter, was NOT reached."
    return f"It was sampled until every parameter had a {limits}."


def _prior_sentence(fit: Record) -> str:
    """Return the priors of all free parameters in a sentence."""
    shown = "; ".join(f"{p.name} {p.prior_text}" for p in fit.model.space.free)
    return f"Priors: {shown}." if fit.sampled is not None and shown else ""


def sampler_text(sampler: dict[str, Any]) -> str:
    """Describe the sampler in a few words.

    Args:
        sampler: The page "sampler" of summary.json.
    """
    if sampler["method"] == "nuts":
        return f"NUTS, {sampler['ensembles']} chains of {sampler['steps']} draws after {sampler['warm_up']} of warm-up"
    if sampler["method"] == "importance":
        batches = f"{sampler['ensembles']} batches of {sampler['steps']} draws"
        return f"importance sampling, {batches}, Pareto k {sampler['pareto_k']:.2f}"
    return f"{sampler['ensembles']} ensembles of {sampler['walkers']} walkers, {sampler['steps']} steps"


def sampler_sentences(page: dict[str, Any]) -> list[str]:
    """Describe how trajectories went, whether a second sampler agrees, and which to try instead; empty of most fits.

    Args:
        page: Contents of summary.json.
    """
    sampler, sentences = page.get("sampler", {}), []
    if sampler.get("method") == "nuts":
        sentences.append(_trajectories(sampler))
    if page.get("samplers", {}).get("agree"):  # a disagreement stands among the reasons
        sentences.append(page["samplers"]["sentence"])
    return [*sentences, *filter(None, [sampler.get("recommendation")])]


def _trajectories(sampler: dict[str, Any]) -> str:
    """Describe how the trajectories of NUTS went."""
    diverged = f"{sampler['diverged']} of {sampler['total']} trajectories diverged" if sampler["diverged"] else ""
    if sampler["diverged"] and not sampler["fine_diverged"]:
        diverged += f", none of the {sampler['fine']} of fine steps that reach where the others break off"
    mixing = sampler["energy_mixing"]
    energy = f"energy mixing (E-BFMI) {mixing:.2f}" if mixing is not None else "energy mixing could not be computed"
    long = f"; {sampler['saturated']} were cut off at their longest" if sampler["saturated"] else ""
    return f"NUTS: {diverged or 'no trajectory diverged'}; {energy} (0.3 or more is good){long}."
