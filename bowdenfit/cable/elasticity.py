"""The elastic side of a cable: how its rope stretches, and what preload it has at a wrap angle."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.laws import ContactLaw
from bowdenfit.description import Description, PriorDefaults
from bowdenfit.parameters.priors import HalfCauchy, HalfNormal, LogNormal, TruncatedNormal
from bowdenfit.parameters.space import Parameter, Scale
from bowdenfit.physics.loop import Rope
from bowdenfit.physics.stretch import (
    bedded_share,
    compliance_along,
    extension,
    extension_along,
    mean_tension,
    mean_tension_from_shares,
    mean_tension_unloading,
    preload_at,
    tension_from_extension,
)
from bowdenfit.types import DataArray

STIFFNESS, BEDDING_STRETCH, BEDDING_LOAD = "stiffness", "bedding_stretch", "bedding_load"
LENGTHENING, PRELOAD, STRETCH_ZERO, STRETCH_FRICTION = "lengthening", "preload", "stretch_zero", "mu_stretch"

Values = Mapping[str, Array]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class StretchRows:
    """Loads and wrap angles of the rows of a table of stretch.

    Args:
        load: Load of each row [N], (rows).
        peak: Largest load before it [N], (rows).
        wrap_angles: The different wrap angles [rad], (angles).
        spread: Matrix that gives each row its own, (angles, rows).
    """

    load: DataArray
    peak: DataArray
    wrap_angles: DataArray
    spread: DataArray


@dataclass(frozen=True)
class Elasticity:
    """Stretch and preload of one cable; every function takes the values of its parameters [internal units].

    Args:
        description: Parsed cable.toml.
        law: Law of the contact that the rope as a whole is while it is stretched.
    """

    description: Description = field(repr=False)
    law: ContactLaw

    @property
    def reference_angle(self) -> float:
        """Wrap angle at which the parameter `preload` holds [rad]."""
        return self.description.preload.wrap_angle.to("angle")

    def rope(self, values: Values) -> tuple[Array, Array, Array]:
        """Return stiffness [N/mm], bedding-in stretch [mm] and the load over which it is taken up [N]."""
        return values[STIFFNESS], values[BEDDING_STRETCH], values[BEDDING_LOAD]

    def extension(self, values: Values, tension: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return extension of the rope under a tension that is the same all along it [mm]."""
        return extension(tension, *self.rope(values))

    def extension_along(self, values: Values, mean: Array, exponent: Array) -> Array:
        """Return the extension of the rope while all of it slides, by its mean tension [mm]."""
        return extension_along(mean, exponent, self.rope(values))

    def compliance_along(self, values: Values, mean: Array, exponent: Array) -> Array:
        """Return change of that extension with the mean tension [mm/N]."""
        return compliance_along(mean, exponent, self.rope(values))

    def tension(self, values: Values, extended: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the tension from the extension [N]; 0 where the rope is slack."""
        return tension_from_extension(extended, *self.rope(values))

    def friction_exponent(self, values: Values, wrap_angle: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the friction exponent while the rope is stretched [1]."""
        return self.law.exponent(values, wrap_angle)

    def stretch(
        self,
        values: Values,
        load: Float[Array, "*batch"],
        wrap_angle: Float[Array, "*batch"],
        peak: Float[Array, "*batch"],
    ) -> Float[Array, "*batch"]:
        r"""Return the stretch seen at the loaded end [mm], :math:`\overline{e(T)} + g \theta - \Delta L_0`.

        Args:
            values: Values of the parameters.
            load: F [N].
            wrap_angle: theta [rad].
            peak: Largest load before, from which the load comes down; the load itself while it grows [N].
        """
        exponent = self.friction_exponent(values, wrap_angle)
        mean = mean_tension_unloading(load, peak, exponent)
        extended = self._extension_unloading(values, load, peak, exponent, mean)
        return extended + values[LENGTHENING] * wrap_angle - values[STRETCH_ZERO]

    def _extension_unloading(self, values: Values, load: Array, peak: Array, exponent: Array, mean: Array) -> Array:
        """Return the extension averaged along a rope with a mean tension that comes down from a peak [mm]."""
        stiffness, stretch, bedding_load = self.rope(values)
        return mean / stiffness + stretch * bedded_share(load, peak, exponent, bedding_load)

    def stretch_of_rows(self, values: Values, rows: StretchRows) -> Float[Array, " rows"]:
        """Return the same for the rows of a table, friction worked out once for every different wrap angle [mm].

        Args:
            values: Values of the parameters.
            rows: Loads and wrap angles.
        """
        exponent, spread = self.friction_exponent(values, rows.wrap_angles), rows.spread
        unit = jnp.ones_like(exponent)
        lengthened = values[LENGTHENING] * rows.wrap_angles - values[STRETCH_ZERO]
        of_angle = jnp.stack([exponent, mean_tension(unit, exponent), mean_tension(unit, -exponent), lengthened])
        exponents, loading, unloading, lengthened = of_angle @ spread
        mean = mean_tension_from_shares(rows.load, rows.peak, exponents, loading, unloading)
        return self._extension_unloading(values, rows.load, rows.peak, exponents, mean) + lengthened

    def preload(
        self, values: Values, bend: Float[Array, "*batch"]
    ) -> tuple[Float[Array, "*batch"], Float[Array, "*batch"]]:
        """Return preload [N] and slack [mm] at a total wrap angle [rad]."""
        return self.preload_from(values, values[PRELOAD], bend)

    def preload_or_none(self, values: Values, bend: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the preload [N]; 0 for a cable of which no measurement depends on it."""
        return self.preload(values, bend)[0] if PRELOAD in values else jnp.zeros(bend.shape)

    def loop_rope(self, values: Values) -> Rope:
        """Return `rope` where it alone sets the preload of a loop; None elsewhere, as with springs, which are linear."""
        return self.rope(values) if self.description.preload_follows_stretch and STIFFNESS in values else None

    def preload_from(
        self, values: Values, reference_preload: Float[Array, "*#batch"], bend: Float[Array, "*batch"]
    ) -> tuple[Float[Array, "*batch"], Float[Array, "*batch"]]:
        """Return preload [N] and slack [mm] at a total wrap angle [rad] of a cable preloaded otherwise."""
        if not self.description.preload_follows_stretch:
            return jnp.broadcast_to(reference_preload, bend.shape), jnp.zeros(bend.shape)
        return preload_at(
            bend, reference_preload, jnp.asarray(self.reference_angle), values[LENGTHENING], *self.rope(values)
        )


def spread_matrix(at: np.ndarray) -> np.ndarray:
    """Return the matrix of zeros and ones that gives each row what belongs to its case, quicker than indexing.

    Args:
        at: Number of the case of each row.
    """
    return (np.arange(at.max(initial=-1) + 1)[:, None] == at).astype(float)


@dataclass(frozen=True)
class RopeScales:
    """What priors of the rope are in proportion to.

    Args:
        load: Load at which it was stretched.
        stiffness: Load over stretch.
        stretch: How far it stretches.
        lengthening: Stretch over wrap angle, in mm/rad.
    """

    load: Scale
    stiffness: Scale
    stretch: Scale
    lengthening: Scale


def rope_parameters(defaults: PriorDefaults, by: RopeScales) -> list[Parameter]:
    """Return how the rope stretches and the sheath lengthens."""
    degree, lengthening = float(np.deg2rad(1.0)), HalfCauchy(by.lengthening.value)
    return [
        Parameter(
            STIFFNESS, "$k$", "stiffness of the rope once bedded in", "elastic",
            LogNormal(by.stiffness.value, defaults.stiffness_log_sd), "N/mm", scaled_by=str(by.stiffness),
        ),
        Parameter(
            BEDDING_STRETCH, "$d$", "stretch that bedding in takes up", "elastic",
            HalfNormal(by.stretch.value), "mm", scaled_by=str(by.stretch),
        ),
        Parameter(
            BEDDING_LOAD, "$T_c$", "load over which the rope beds in", "elastic",
            LogNormal(by.load.value, defaults.bedding_load_log_sd), "N", scaled_by=str(by.load),
        ),
        Parameter(
            LENGTHENING, "$g$", "lengthening of the sheath's center line by bending", "elastic",
            lengthening, "mm/deg", degree, prior_words=lengthening.text("mm/deg", degree, 3), scaled_by=str(by.lengthening),
        ),
    ]  # fmt: skip


def preload_parameter(description: Description, defaults: PriorDefaults, by: Scale) -> Parameter:
    """Return the parameter of the preload: stated with or without its standard deviation, or free."""
    settings = description.preload
    at = f" at {settings.wrap_angle.value:g} {settings.wrap_angle.unit}" if description.preload_follows_stretch else ""
    name, meaning = (PRELOAD, "$P_0$" if at else "$P$"), f"preload{at}"
    prior = LogNormal(by.value, defaults.preload_log_sd)
    free = Parameter(*name, meaning, "elastic", prior, "N", scaled_by=str(by))
    if settings.value is None:
        return free
    value, sd = settings.value.to("force"), settings.value.sd_to("force")
    if sd is None:
        return replace(free, fixed=value, prior_words="fixed (stated)", scaled_by="")
    return replace(free, prior=TruncatedNormal(value, sd), scaled_by="")
