"""How the draws came about, for people: the sampler, how it went, whether a second one agrees."""

from typing import Any


def sampler_text(sampler: dict[str, Any]) -> str:
    """The sampler in a few words.

    Args:
        sampler: The page "sampler" of summary.json.
    """
    if sampler["method"] == "nuts":
        return f"NUTS, {sampler['ensembles']} chains of {sampler['steps']} draws after {sampler['warm_up']} of warm-up"
    return f"{sampler['ensembles']} ensembles of {sampler['walkers']} walkers, {sampler['steps']} steps"


def sampler_sentences(page: dict[str, Any]) -> list[str]:
    """How trajectories went, whether a second sampler agrees, and which to try instead; empty of most fits.

    Args:
        page: What summary.json holds.
    """
    sampler, sentences = page.get("sampler", {}), []
    if sampler.get("method") == "nuts":
        sentences.append(_trajectories(sampler))
    if page.get("samplers", {}).get("agree"):  # a disagreement stands among the reasons
        sentences.append(page["samplers"]["sentence"])
    return [*sentences, *filter(None, [sampler.get("recommendation")])]


def _trajectories(sampler: dict[str, Any]) -> str:
    diverged = f"{sampler['diverged']} of {sampler['drawn']} trajectories diverged" if sampler["diverged"] else ""
    if sampler["diverged"] and not sampler["fine_diverged"]:
        diverged += f", none of the {sampler['fine']} of fine steps that reach where the others break off"
    mixing = sampler["energy_mixing"]
    energy = f"energy mixing (E-BFMI) {mixing:.2f}" if mixing is not None else "energy mixing could not be computed"
    long = f"; {sampler['saturated']} were cut off at their longest" if sampler["saturated"] else ""
    return f"NUTS: {diverged or 'no trajectory diverged'}; {energy} (0.3 or more is good){long}."
