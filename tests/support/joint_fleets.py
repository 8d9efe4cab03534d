"""A fleet in one density, every reading of every cable with its population: the check on draws that are pooled afterwards."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.inference.nuts import BLOCK, WARM_UP, before, block_program
from bowdenfit.inference.population.model import PopulationDensity
from bowdenfit.inference.population.sampling import _SETTINGS
from bowdenfit.questions.fleet.cases import read_cases
from bowdenfit.questions.fleet.inspections import read_inspections
from bowdenfit.questions.pool.inspected import Given


def joint_draws(folder: Path, given: Given, blocks: int, seed: int):
    """Draws of population and cables by NUTS on all readings at once: mean, spread, effects, cables.

    The coordinates of cables are those of the pooled ones, which decide nothing: their volume is in the density. Scatter and
    noise of each inspection are drawn too, under the priors of single fits.

    Args:
        folder: Of the fleet's measurements.
        given: What is pooled of it.
        blocks: Of 50 steps of four chains, after warm-up.
        seed: Of everything random.
    """
    cases = {case.inspection.label: case for case in read_cases(folder, read_inspections(folder), {})}
    cases = [cases[label] for label in given.labels]
    posterior = cases[0].shaped.posterior
    free = posterior.model.space.free
    places = np.array([[p.name for p in free].index(name) for name in given.coefficients])
    others = np.setdiff1d(np.arange(len(free)), places)
    medians = np.array([np.log(float(free[i].prior.median)) for i in places])
    sds = np.array([float(free[i].prior.log_sd) for i in places])
    inspected = given.inspected
    density = PopulationDensity(
        inspected.coefficients, inspected.cycles is not None, tuple(inspected.effects), inspected.cables
    )
    place = np.array([np.sum(inspected.cable[:j] == i) for j, i in enumerate(inspected.cable)])
    data = {
        "population": inspected.data,
        "readings": jax.tree.map(lambda *leaves: np.stack(leaves), *(case.shaped.data for case in cases)),
    }
    size = density.size + len(cases) * len(others)

    def log_density(z, data):
        inner, rest = z[: density.size], z[density.size :].reshape(len(cases), len(others))
        found = density.population(inner, data["population"])
        values, volume = density.cables_of(inner, data["population"], found)
        logs = density.log_coefficients(values, found, data["population"])[inspected.cable, place]
        own = (logs - medians) / sds
        single = jnp.zeros((len(cases), len(free))).at[:, places].set(own).at[:, others].set(rest)
        of_readings = jax.vmap(posterior.log_density)(single, data["readings"]) + jnp.sum(own**2, axis=1) / 2
        away = (values - found["mean"]) / found["spread"]
        of_cables = jnp.sum(volume) - jnp.sum(away**2) / 2 - density.cables * jnp.sum(jnp.log(found["spread"]))
        return jnp.sum(of_readings) + of_cables - jnp.sum(inner[: len(density.names)] ** 2) / 2

    shapes = jax.tree.map(lambda leaf: jax.ShapeDtypeStruct(np.shape(leaf), np.asarray(leaf).dtype), data)
    program = block_program(log_density, (size,), shapes, _SETTINGS, fine=False)
    start = 0.3 * np.random.default_rng(seed).standard_normal((_SETTINGS.n_chains, size))
    done: list = []
    for number in range(WARM_UP + blocks):
        z, tuning, mass = before(done, start, np.ones(size))
        step = program(np.uint32(seed), np.uint32(number), z, tuning, np.bool_(number < WARM_UP), mass, data)
        done.append({name: np.asarray(value) for name, value in step.items()})
    z = np.concatenate([block["z"] for block in done[WARM_UP:]]).transpose(1, 0, 2)

    def values_of(one):
        found = density.population(one, inspected.data)
        return found["mean"], found["spread"], found["effects"], density.cables_of(one, inspected.data, found)[0]

    assert z.shape[1] == blocks * BLOCK
    return z, jax.jit(jax.vmap(values_of))(z[:, :, : density.size].reshape(-1, density.size))
