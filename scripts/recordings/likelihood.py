"""The cost of one log density, for both likelihoods and two models of friction."""

import dataclasses
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from benchmark_tables import Table, say

import bowdenfit
from bowdenfit.dataset import Dataset
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.kinds.descriptions import load_description
from bowdenfit.models import build_model
from recordings.simulated import SEED, Simulated
from recordings.timing import milliseconds

VALUE_TARGET, GRADIENT_TARGET = 10.0, 20.0  # ms
FRICTIONS = ("capstan", "drag+load-dependent")


def likelihood_tables(simulated: Simulated) -> list[Table]:
    """Cost of one log density, for both likelihoods and two models of friction, long and short."""
    targets = f"value (< {VALUE_TARGET:g}) [ms]", f"with gradient (< {GRADIENT_TARGET:g}) [ms]"
    rows = [["log density", "arrays [kB]", *targets, "batch", "batch [ms]", "long/short", "compiling [s]"]]
    folders = {"long": simulated.long, "short": simulated.short}
    data = {name: bowdenfit.read(folder) for name, folder in folders.items()}
    for likelihood in ("runs", "whole"):
        for friction in FRICTIONS:
            say(f"likelihood {likelihood}, {friction}")
            overrides = [f'tables.recordings.likelihood="{likelihood}"', f'friction_model="{friction}"']
            item = {name: density_costs(described(data[name], folders[name], overrides)) for name in folders}
            for name, costs in item.items():
                ratio = f"{costs.value / item['short'].value:.2f}" if name == "long" else ""
                times = f"{costs.value:.3f}", f"{costs.gradient:.3f}", str(costs.batch), f"{costs.batched:.2f}"
                rows.append(
                    [
                        f"{likelihood}, {friction}, {name}",
                        f"{costs.kilobytes:.0f}",
                        *times,
                        ratio,
                        f"{costs.compiling:.1f}",
                    ]
                )
    return [rows]


@dataclass(frozen=True)
class Costs:
    """Times of one log density [ms]: alone, with its gradient, a batch; size of its data, and time to compile all [s]."""

    value: float
    gradient: float
    batch: int
    batched: float
    kilobytes: float
    compiling: float


def described(data: Dataset, folder: Path, overrides: Sequence[str]) -> Dataset:
    """The same measurements under other settings that do not change how they are read."""
    return dataclasses.replace(data, description=load_description(folder / "cable.toml", overrides))


def density_costs(data: Dataset) -> Costs:
    """Measure one posterior."""
    with jax.enable_x64(True):
        start = time.perf_counter()
        density = LogDensity(build_model(data))
        settings, size = data.description.sampler, density.model.space.size
        batch = settings.n_ensembles * settings.walkers(size) // 2
        many = jnp.asarray(0.1 * np.random.default_rng(SEED).standard_normal((batch, size)))
        arrays = jax.device_put(density.data)
        value = jax.jit(density.log_density).lower(many[0], arrays).compile()
        gradient = jax.jit(jax.value_and_grad(density.log_density)).lower(many[0], arrays).compile()
        batched = compile_program(jax.vmap(density.log_density, (0, None)), many, density.data)
        compiling = time.perf_counter() - start
        bytes_of = sum(np.asarray(leaf).nbytes for leaf in jax.tree.leaves(density.data))
        timed = partial(milliseconds, budget=0.5)
        alone = timed(value, many[0], arrays), timed(gradient, many[0], arrays)
        return Costs(*alone, batch, timed(batched, many, arrays), bytes_of / 1000, compiling)
