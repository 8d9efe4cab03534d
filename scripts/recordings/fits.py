"""Whole fits of recordings, their stages, and those of another checkout beside them."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from benchmark_tables import Table, say
from processes import ROOT, Run, measured, typical

from recordings.reading import reader
from recordings.simulated import LENGTHS, Simulated

FIT_TARGET, MEMORY_TARGET = 20.0, 1024.0  # s, MiB
BESIDE = ", beside"  # ends the names of stages that run while others do


def fit_tables(simulated: Simulated) -> Iterator[Table]:
    """Whole fits, long and short, and their stages."""
    folders = {"CSV, long": simulated.long, "Parquet, long": simulated.long_parquet, "CSV, short": simulated.short}
    say("(one fit that is not measured)")
    fit(simulated, simulated.short, "unmeasured", "--no-mcmc")
    fits, steps, remaining = {}, {}, {}
    for name, folder in folders.items():
        runs, against = [], []
        for i in range(simulated.size.repeats):
            say(f"fit, {name}, {i + 1} of {simulated.size.repeats}")
            results = f"{name} {i}".replace(", ", "_").replace(" ", "_")
            runs.append(fit(simulated, folder, results))
            if simulated.against:
                against.append(fit(simulated, folder, f"{results}_against", tree=simulated.against))
        fits[name] = typical(runs)
        remaining[name] = list(zip(runs, against, strict=False))
        steps[name] = json.loads(reader(simulated, "steps", folder).output)
    samples = {name: (1000 if "short" in name else 1000 * simulated.size.cycles) for name in folders}
    rows = [["fit of ten recordings", "samples", "wall [s]", "target [s]", "peak [MiB]", "target [MiB]"]]
    for name, run in fits.items():
        numbers = [f"{len(LENGTHS) * samples[name]}", f"{run.seconds:.2f}", f"{FIT_TARGET:g}"]
        rows.append([name, *numbers, f"{run.memory:.0f}", f"{MEMORY_TARGET:.0f}"])
    yield rows
    if simulated.against:
        yield pair_table(remaining)
    yield from (step_table(fits, steps), stage_table(fits, steps))


def pair_table(pairs: dict[str, list[tuple[Run, Run]]]) -> Table:
    """Fits beside those of another checkout."""
    rows = [["fit beside the other checkout's", "ratio of times", "lowest", "highest", "ratio of memory"]]
    for name, pair in pairs.items():
        times, memory = ([getattr(a, case) / getattr(b, case) for a, b in pair] for case in ("seconds", "memory"))
        rows.append([name, *(f"{x:.2f}" for x in (np.median(times), min(times), max(times), np.median(memory)))])
    return rows


def fit(simulated: Simulated, folder: Path, name: str, *options: str, tree: Path = ROOT) -> Run:
    """Fit in a fresh process whose compilation cache is empty, with the bowdenfit of a checkout."""
    results = simulated.folder / "results" / name
    environment = simulated.environment | {"XDG_CACHE_HOME": str(simulated.folder / "cache" / name)}
    environment |= {"PYTHONPATH": str(tree), "PYTHONSAFEPATH": "1"}
    arguments = ["-m", "bowdenfit", "fit", str(folder), "--seed", "1", "--output", str(results), *options]
    return measured(arguments, environment, results)


def step_table(fits: dict[str, Run], steps: dict[str, dict[str, float]]) -> list[list[str]]:
    """Seconds of each step from the files to the model, in a process of its own."""
    names = list(dict.fromkeys(step for item in steps.values() for step in item))
    rows = [["steps before the fit [s]", *fits]]
    rows += [[step, *(f"{steps[name].get(step, 0.0):.2f}" for name in fits)] for step in names]
    return [*rows, ["sum", *(f"{sum(steps[name].values()):.2f}" for name in fits)]]


def stage_table(fits: dict[str, Run], steps: dict[str, dict[str, float]]) -> list[list[str]]:
    """Seconds of each stage of fit.json; the steps before are another process's, so that the rest is a difference."""
    names = list(dict.fromkeys(stage for run in fits.values() for stage in run.stages))
    rows = [["stages of the fit [s]", *fits]]
    rows += [[stage, *(f"{run.stages.get(stage, 0.0):.2f}" for run in fits.values())] for stage in names]
    alone = {name: [s for stage, s in run.stages.items() if not stage.endswith(BESIDE)] for name, run in fits.items()}
    rests = {name: run.seconds - sum(alone[name]) for name, run in fits.items()}
    rows.append(["start, reading, figures, writing", *(f"{folder_times:.2f}" for folder_times in rests.values())])
    after = {name: folder_times - sum(steps[name].values()) for name, folder_times in rests.items()}
    return [*rows, ["of these not in the steps above", *(f"{folder_times:.2f}" for folder_times in after.values())]]
