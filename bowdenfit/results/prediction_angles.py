"""Wrap angles that predictions at route values use: the curves', measured ones outside their range, or stated ones."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import CableContacts
from bowdenfit.dataset import Dataset
from bowdenfit.errors import UsageError
from bowdenfit.inference.draws import for_each_draw
from bowdenfit.kinds import iterate_tables
from bowdenfit.kinds.kind import FrictionKind
from bowdenfit.kinds.row_angles import ROUNDING, RowAngles, collect_row_angles, find_measured_angle, resolve_angles
from bowdenfit.kinds.rows import OwnAngles, RowConditions
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.models import Model
from bowdenfit.words import listed

MOST_LENGTHS = 10_000  # judged: a metre of cable by tenths of a millimetre; takes minutes
_AT_ONCE = 500  # judged: lengths of which 10,000 draws of a force take 40 MB
NO_ANGLES: Mapping[int, float] = MappingProxyType({})
_STREAM = 11  # of random numbers, beside the fit's own


@dataclass(frozen=True)
class PredictionAngles:
    """Wrap angle of each contact at each route value: the curve's, or one of its own with its error.

    Args:
        rows: Route values and own angles, as of rows of a table.
        seed: Seed of the errors.
        notes: Stated angles at each route value, in words; empty without any.
        outside: That a route value lies outside the curves, and what serves there, in words; empty inside.
    """

    rows: RowAngles
    seed: int
    notes: tuple[str, ...]
    outside: tuple[str, ...]

    def draw_errors(self, n: int) -> Float[np.ndarray, "draws errors"]:
        """Return normal scores of the errors of own angles in each draw; no columns where all angles are exact.

        Those at a route value are the same whatever others are asked for beside it.
        """
        rows = self.rows
        if rows.is_exact:
            return np.zeros((n, 0))
        seeds = [[self.seed, _STREAM, int(bits)] for bits in np.asarray(rows.route, dtype=float).view(np.uint64)]
        scores = [np.random.default_rng(seed).standard_normal((n, rows.own.shape[1])) for seed in seeds]
        return np.concatenate(scores, axis=1)

    def resolve(self, cable: CableContacts, values: Mapping[str, Array], errors: Array) -> Float[Array, "places contacts"]:
        """Return the wrap angles [rad] at given parameters and errors, which make none negative."""
        angles, variance = resolve_angles(cable, values, jax.tree.map(jnp.asarray, self.rows))
        if not errors.size:
            return angles
        return jnp.maximum(angles + errors.reshape(angles.shape) * jnp.sqrt(variance), 0.0)


def split_lengths(lengths: np.ndarray) -> list[np.ndarray]:
    """Return route values in parts that are predicted one after the other, so that the memory taken does not grow with them.

    Raises:
        UsageError: They are too many.
    """
    if len(lengths) > MOST_LENGTHS:
        raise UsageError(
            f"{len(lengths):,} lengths are asked for, and at most {MOST_LENGTHS:,} are predicted at a time; ask for fewer, "
            "because curves barely change over such small steps."
        )
    return [lengths[start : start + _AT_ONCE] for start in range(0, max(len(lengths), 1), _AT_ONCE)]


def choose_angles(
    dataset: Dataset, route: np.ndarray, stated: Mapping[int, float | np.ndarray], seed: int, bent: int | None = None
) -> PredictionAngles:
    """Return the wrap angles that a prediction uses.

    A stated angle comes first. Outside the range of the curves follow the angle table's row at the same length, then the mean
    of what rows of forces and efficiencies have there, with errors as the likelihood has them; inside, the curve.

    Args:
        dataset: The data set.
        route: Route values.
        stated: Stated wrap angles [rad], by number of the contact: one that holds at all route values, or one for each, NaN
            where the contact keeps its own.
        seed: Seed of the errors of measured angles.
        bent: Number of a contact that takes other wrap angles than these, so that none is needed; None without one.

    Raises:
        UsageError: Outside the range of the curves no wrap angle was measured or stated.
    """
    description, at = dataset.description, np.array(route, dtype=float)
    contacts, limits = description.contact, description.route
    outside = ["" if limits is None else limits.outside(value) for value in at]
    angle_at = {k: np.broadcast_to(np.asarray(angle, dtype=float), at.shape) for k, angle in stated.items()}
    fully_stated = [k for k, angle in angle_at.items() if not np.isnan(angle).any()]
    curved = [
        k for k, c in enumerate(contacts) if c.wrap_angle.curve and c.wrap_angle.column and k not in (*fully_stated, bent)
    ]
    names = tuple(contacts[k].wrap_angle.column or "" for k in curved)
    own_angles = OwnAngles.none(names, len(at))
    for i in [i for i, words in enumerate(outside) if words and curved]:
        missing, own_curves = [], [j for j, k in enumerate(curved) if np.isnan(angle_at[k][i] if k in angle_at else np.nan)]
        for j in own_curves:
            name = names[j]
            measured = next(_measured_angles(dataset, name, at[i]), None)
            if measured is None:
                missing.append(contacts[curved[j]].name)
            else:
                own_angles.angle[i, j], own_angles.sd[i, j] = measured
        if missing:
            _refuse_unmeasured(f"{at[i]:.6g} {limits.unit if limits else ''}", outside[i], missing)
        outside[i] += ": by the wrap angles measured there" if own_curves else ": by the wrap angles stated"
    rows = collect_row_angles(description, RowConditions(at, own_angles), None)
    words: list[list[str]] = [[] for _ in at]
    for contact, angle in angle_at.items():
        here = ~np.isnan(angle)
        rows.own[here, contact], rows.is_own[here, contact] = angle[here], True
        rows.known_variance[here, contact], rows.noisy[here, contact] = 0.0, False
        for place in np.flatnonzero(here):
            words[place].append(f"{contacts[contact].name!r} bent by {np.rad2deg(angle[place]):.4g} deg")
    return PredictionAngles(replace(rows, route=at), seed, tuple(map(listed, words)), tuple(outside))


def _measured_angles(dataset: Dataset, column: str, at: float) -> Iterator[tuple[float, float]]:
    """Yield wrap angles [rad] that were measured at a route value, and their sd (NaN for that of the angle table's noise)."""
    table = dataset.measurements.table(AngleTable)
    if table is not None and column in table.names:
        at_row = find_measured_angle(table, column, at)
        if at_row is not None and np.isfinite(at_row[0]):
            yield at_row
    for kind, rows in iterate_tables(dataset.measurements):
        if isinstance(kind, FrictionKind):
            conditions = kind.conditions(rows)
            angle, sd = conditions.own.column(column)
            mask = np.isclose(conditions.route, at, rtol=ROUNDING, atol=0.0) & ~np.isnan(angle)
            if mask.any():
                finite = sd[mask][~np.isnan(sd[mask])]
                yield float(angle[mask].mean()), float(finite.mean()) if len(finite) else np.nan


def _refuse_unmeasured(place: str, outside: str, contacts: Sequence[str]) -> None:
    """Refuse a route value at which no wrap angle is known."""
    named = listed([repr(name) for name in contacts])
    raise UsageError(
        f"{place} lies {outside}, and no wrap angle of {named} was measured there; a curve says nothing beyond its range. "
        f"Measure the wrap angles there, in a row of the angle table, or give each to predict, as --wrap-angle "
        f"'{contacts[0]}=30deg'."
    )


def predict_forces(
    model: Model,
    z: np.ndarray,
    angles: PredictionAngles,
    force: float | np.ndarray,
    stroke: int | np.ndarray,
    mountings: Sequence[np.ndarray],
    *,
    inverse: bool = False,
) -> list[np.ndarray]:
    """Return the output force [N] of draws (rows) at route values (columns), at the reference speed, for some mountings.

    Args:
        model: The model.
        z: Draws, one a row.
        angles: Wrap angles at the route values.
        force: Force at the motor side [N]: one, or one for each route value.
        stroke: +1 pulling, -1 return; likewise.
        mountings: Effect of each mounting on the friction exponent of each draw [1].
        inverse: Return the input force instead, given the force at the load side.
    """
    cable = model.cable
    function = cable.input_force_at_angles if inverse else cable.output_force_at_angles

    def other_end(draw: Float[Array, " free_and_more"]) -> Float[Array, " places"]:
        z, mounting, errors_of_draw = jnp.split(draw, [model.space.size, model.space.size + 1])
        values = model.space.constrain(z)
        bends = angles.resolve(cable, values, errors_of_draw)
        known = jnp.asarray(force, dtype=float), jnp.asarray(stroke, dtype=float)
        return function(values, bends, *known, mounting[0], jnp.asarray(angles.rows.route))

    errors = angles.draw_errors(len(z))
    program = for_each_draw(other_end, model.space.size + 1 + errors.shape[1])
    return [program(np.column_stack([z, mounting, errors])) for mounting in mountings]
