"""Data sets in a form that one program serves: which ones share it, and the data that tell them apart.

Default priors of quantities with a unit are proportional to the size of the measurements, so every data set has priors of its
own. Here the priors have unit scale, and the scale is one more array of the data: z, and the density in z, are the same.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import jax
import numpy as np
from jax import Array

from bowdenfit.cable.cable import CableContacts
from bowdenfit.dataset import Dataset
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.kinds.term import Term, find_row_angles
from bowdenfit.models import Model, build_model
from bowdenfit.parameters.priors import HalfCauchy, HalfNormal, LogNormal, Normal, Prior
from bowdenfit.parameters.space import Parameter, ParameterSpace

_IRRELEVANT_KEYS = {"name", "source", "license", "file", "files"}  # keys of a description that do not affect a fit
_DATA_FIELDS = ("cable", "data", "labels", "rows")  # fields of a term that are data, or enter the key by themselves


@dataclass(frozen=True)
class ScaledDensity(LogDensity):
    """A posterior whose data end with the scales of the priors that are proportional to measurements."""

    def values(self, z: Array, data: Any) -> dict[str, Array]:
        """See `LogDensity.values`."""
        unit = super().values(z, data)
        return unit | {name: unit[name] * data[-1][i] for i, name in enumerate(_scaled_names(self.model.space))}


@dataclass(frozen=True)
class ShapedDataset:
    """A data set in a form that one program shares with others.

    Args:
        posterior: Posterior with priors of unit scale, the same program for all data sets with one key.
        data: Its own data.
        key: Everything the program depends on; equal keys share a program.
    """

    posterior: ScaledDensity
    data: Any
    key: str


def shape_dataset(dataset: Dataset, spare: bool = False) -> ShapedDataset:
    """Return a data set with the scales of its priors as data.

    Args:
        dataset: Data set with its measurements.
        spare: Whether its data have room for more mountings, so that the program serves them too.
    """
    model = build_model(dataset)
    units = [_to_unit_scale(parameter) for parameter in model.space.parameters]
    space = ParameterSpace(tuple(parameter for parameter, _ in units))
    scales = np.array(
        [scale for parameter, scale in units if parameter.fixed is None and scale is not None], dtype=float
    )
    density = LogDensity(model)
    data = (*(density.with_spare_rows if spare else density.padded), scales)
    cable = replace(model.cable, nominal=dict.fromkeys(model.cable.nominal, 1.0)) if _has_angles(model) else model.cable
    posterior = ScaledDensity(_with_cable(cable, space, model.terms), data)
    return ShapedDataset(posterior, data, _program_key(posterior))


def _has_angles(model: Model) -> bool:
    """Return whether every row has its own angle wherever the mean angle of all rows would be used otherwise."""
    nominal = [c.name in model.cable.nominal for c in model.description.contact]
    angles = [find_row_angles(term.data) for term in model.terms]
    return all(rows is not None and np.all(rows.is_own[..., nominal]) for rows in angles)


def _with_cable(cable: CableContacts, space: ParameterSpace, terms: Sequence[Term]) -> Model:
    """Return a model of the same terms with another cable."""
    return Model(cable, space, tuple(replace(term, cable=cable) for term in terms))  # type: ignore[type-var]


def _scaled_names(space: ParameterSpace) -> list[str]:
    """Return names of parameters whose priors the data scale."""
    return [p.name for p in space.free if p.scaled_by and _scale_of(p.prior) is not None]


def _to_unit_scale(parameter: Parameter) -> tuple[Parameter, float | None]:
    """Return a parameter with a prior of unit scale, and the scale; None where measurements do not scale it."""
    scale = _scale_of(parameter.prior) if parameter.scaled_by else None
    if scale is None:
        return parameter, None
    prior = parameter.prior
    unit = {field: 1.0 for field in ("scale", "sd", "median") if hasattr(prior, field)}
    return replace(parameter, prior=replace(prior, **unit), prior_words="", scaled_by="measurements"), scale  # type: ignore[type-var]


def _scale_of(prior: Prior) -> float | None:
    """Return the factor between a prior and that of unit scale; None where they differ by more than a factor."""
    match prior:
        case HalfCauchy(scale=scale):
            return float(scale)
        case HalfNormal(sd=sd):
            return float(sd)
        case Normal(mean=mean, sd=sd) if mean == 0:
            return float(sd)
        case LogNormal(median=median):
            return float(median)
    return None


def _program_key(posterior: ScaledDensity) -> str:
    """Return a digest of what a program depends on: shapes, parameters, description, and conditions where they matter."""
    shapes = jax.tree.map(lambda array: (np.shape(array), str(np.asarray(array).dtype)), posterior.data)
    terms = [_describe_term(term) for term in posterior.model.terms]
    description = drop_irrelevant_keys(posterior.model.description.to_json())
    cable = posterior.model.cable
    key = f"{shapes} {posterior.model.space.parameters} {description} {terms} {dict(cable.nominal)}"
    return digest(f"{key} {cable.friction.conditions}" if _conditions_matter(posterior.model) else key)


def _conditions_matter(model: Model) -> bool:
    """Return whether the density depends on measured loads and speeds: yes, unless every term says that it does not."""
    return any(getattr(term, "depends_on_conditions", True) for term in model.terms)


def drop_irrelevant_keys(page: Any) -> Any:
    """Return a description without the keys that do not affect a fit."""
    if isinstance(page, Mapping):
        return {key: drop_irrelevant_keys(value) for key, value in page.items() if key not in _IRRELEVANT_KEYS}
    return [drop_irrelevant_keys(item) for item in page] if isinstance(page, list | tuple) else page


def _describe_term(term: Term) -> str:
    """Describe a term apart from its data; arrays by their content."""
    parts = [type(term).__name__]
    for term_field in fields(term):  # type: ignore[arg-type]
        if term_field.name not in _DATA_FIELDS:
            leaves, tree = jax.tree.flatten(getattr(term, term_field.name))
            parts.append(f"{term_field.name} {tree} {[_leaf(leaf) for leaf in leaves]}")
    return " ".join(parts)


def _leaf(leaf: Any) -> str:
    return digest(leaf.tobytes().hex()) if isinstance(leaf, np.ndarray) else repr(leaf)


def digest(text: str) -> str:
    """Return 32 hexadecimal digits that stand for a text."""
    return hashlib.sha256(text.encode()).hexdigest()[:32]
