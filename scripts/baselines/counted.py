"""How many programs a whole fit compiles, and how many times it computes each answer; in one process, under a profiler.

python scripts/baselines/counted.py DATASET
"""

import cProfile
import json
import sys
import tempfile

import jax

import bowdenfit as bf

KEEPER = "once.<locals>.answer"  # what a question that is answered once is wrapped in
COMPILED = "/jax/core/compile/backend_compile_duration"  # what JAX calls it


def questions() -> dict[tuple[str, int, str], str]:
    """Every question that is answered once for each fit, by where a profile has it."""
    results = {}
    for name, module in list(sys.modules.items()):
        for function in vars(module).values() if name.startswith("bowdenfit.") else ():
            if getattr(getattr(function, "__code__", None), "co_qualname", "") == KEEPER:
                question = function.__wrapped__
                code = question.__code__
                results[code.co_filename, code.co_firstlineno, code.co_name] = (
                    f"{question.__module__}.{question.__name__}"
                )
    return results


def main() -> None:
    """Print both as JSON."""
    seconds: list[float] = []
    jax.monitoring.register_event_duration_secs_listener(
        lambda event, duration, **_: seconds.append(duration) if event == COMPILED else None
    )
    profile = cProfile.Profile()
    with tempfile.TemporaryDirectory() as folder:
        profile.runcall(bf.fit, sys.argv[1], output=folder, seed=1, force=True)
    profile.create_stats()
    calls = {question: profile.stats[place][1] for place, question in questions().items() if place in profile.stats}
    print(json.dumps({"programs": len(seconds), "answers": calls}))


if __name__ == "__main__":
    main()
