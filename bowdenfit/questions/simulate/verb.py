"""The verb `simulate`: make a data set whose true values are known."""

import secrets
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bowdenfit.arguments import LARGEST_SEED, PATH, Output, Seed, read_first
from bowdenfit.errors import StoreError, UsageError
from bowdenfit.extensions import SIMULATIONS, load_extension
from bowdenfit.questions import simulate as room
from bowdenfit.verb import Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.dataset import Dataset

BENCH = Parameter("BENCH", help="Such as bench.toml, a cable.toml with [truth] and [design].")


@read_first
def simulate(
    bench: Annotated[str | Path, BENCH, PATH],
    *,
    output: Annotated[Output, Parameter(required=True)] = None,
    seed: Annotated[Seed, Parameter(show_default="random, and recorded")] = None,
    noise: Annotated[bool, Parameter(negative="--no-noise")] = True,
    recordings: bool = False,
    fleet: bool = False,
) -> "Dataset":
    """Make a data set from known truth. Only recordings need an `output`; tables without one are not written.

    Args:
        bench: A cable.toml with [truth] and [design], or with [truth] and [recordings].
        output: Folder for the tables, the truth and the seed; must not exist.
        seed: Random seed.
        noise: Readings that scatter, or exactly as the model expects them.
        recordings: Recordings, sample by sample, as a bench gives them; BENCH has [recordings].
        fleet: Many cables that wear, inspected again and again; BENCH has [fleet]. Answers with the first inspection.

    Raises:
        BowdenfitError: The fault, in a sentence.
    """
    if fleet and recordings:
        raise UsageError("--fleet and --recordings both say what to make; leave one of them out.")
    seed = secrets.randbelow(LARGEST_SEED) if seed is None else seed
    folder = None if output is None else Path(output)
    if folder is not None and folder.exists() and any(p.name != Path(bench).name for p in folder.iterdir()):
        raise StoreError(f"{output} exists already; name another folder with --output, nothing was written.")
    if recordings:
        if folder is None:
            raise UsageError("simulated recordings are files; name a folder for them with output.")
        return room.make_recorded_data_set(Path(bench), folder, seed, noise)
    make = _load_fleet_maker() if fleet else room.make_data_set
    return make(Path(bench), folder, seed, noise)


def _load_fleet_maker() -> "Callable[[Path, Path | None, int, bool], Dataset]":
    """Return what an add-on makes fleets with.

    Raises:
        UsageError: There is none.
    """
    make: Callable[[Path, Path | None, int, bool], Dataset] | None = load_extension(SIMULATIONS, "fleet")
    if make is None:
        raise UsageError("--fleet needs an add-on that comes with bowdenfit, and it is not installed; install bowdenfit again.")
    return make


def _reply(_: "Dataset", options: dict[str, Any]) -> Reply:
    return Reply(f"Wrote {options['output']}. Next: bowdenfit {'fleet' if options['fleet'] else 'fit'} {options['output']}\n")


VERB = Verb(
    simulate,
    _reply,
    """Simulate a data set whose true values are known.

    BENCH is a cable.toml with two more tables: [truth] with the value of each
    parameter (what is missing is drawn from its prior), and [design] with the
    lengths and forces to measure at; datasets/synthetic-bench/bench.toml is one.
    With --recordings it has [recordings] in place of [design]: the motion of the
    motor, the bench, and the errors of its load cells;
    datasets/synthetic-recordings/bench.toml is one. With --fleet it has [fleet]
    besides: how many cables there are, and how they wear;
    datasets/synthetic-fleet/bench.toml is one. The truth and the seed are written
    beside the tables.
    """,
    json="",
)
