"""Would the default tests notice? Six faults in likelihood, sampler and prediction, put into a copy of the package.

    python scripts/check_faults.py

For each fault the default tests that are there for it run until the first that fails. Prints which test noticed each fault, and
ends with 1 if one stays unnoticed.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Fault:
    """One line of the package that is wrong.

    Args:
        description: The fault in words.
        file: Path of the file below `bowdenfit`.
        right: Text that is replaced; the file has it once.
        wrong: Text that replaces it.
        tests: Test files that should notice it.
    """

    description: str
    file: str
    right: str
    wrong: str
    tests: tuple[str, ...]


FAULTS = (
    Fault(
        "likelihood: the scatter of mountings is left out of a run's standard deviation",
        "kinds/runs.py",
        "weights[RUN_SCATTER] ** 2 + from_angles",
        "0.0 * weights[RUN_SCATTER] ** 2 + from_angles",
        ("tests/kinds/test_likelihoods.py", "tests/kinds/recordings/test_recorded_likelihoods.py"),
    ),
    Fault(
        "likelihood: an angle too small to detect counts as one that is too large",
        "kinds/angles/term.py",
        "law.log_cdf(u)))",
        "law.log_cdf(-u)))",
        ("tests/kinds/test_likelihoods.py",),
    ),
    Fault(
        "sampler: a stretch move forgets a dimension in its Jacobian",
        "inference/moves.py",
        "(moving.shape[1] - 1) * jnp.log(factor)",
        "(moving.shape[1] - 2) * jnp.log(factor)",
        ("tests/inference/test_proposals.py",),
    ),
    Fault(
        "sampler: proposals are accepted without the factor of their move",
        "inference/walkers.py",
        "better = factors + proposed.value_in_w",
        "better = 0.0 * factors + proposed.value_in_w",
        ("tests/inference/test_proposals.py", "tests/inference/test_posterior.py"),
    ),
    Fault(
        "prediction: intervals end at 10 and 90 %",
        "inference/interval.py",
        "(0.05, 0.5, 0.95)",
        "(0.1, 0.5, 0.9)",
        ("tests/questions/length/test_predictions.py", "tests/inference/test_recovery.py", "tests/data_sets"),
    ),
    Fault(
        "prediction: the length that is best most often is ranked by the worst efficiency",
        "results/optimal_length.py",
        "best = efficiency.max(axis=1, keepdims=True)",
        "best = efficiency.min(axis=1, keepdims=True)",
        ("tests/questions/length/test_predictions.py",),
    ),
)


def replace_line(fault: Fault, tree: Path) -> str:
    """Return the text of a file of a tree with the fault in it."""
    text = (tree / "bowdenfit" / fault.file).read_text(encoding="utf-8")
    if text.count(fault.right) != 1:
        raise ValueError(f"{fault.file} has not one place of {fault.right!r}; bring scripts/check_faults.py up to date.")
    return text.replace(fault.right, fault.wrong)


def copy_tree(target: Path) -> Path:
    """Copy what the tests need of this checkout into a new folder."""
    ignored = shutil.ignore_patterns(".git", ".venv*", "__pycache__", ".*_cache", "build", "dist")
    return Path(shutil.copytree(ROOT, target, ignore=ignored))


def noticed_by(fault: Fault, copy: Path) -> str:
    """Return the first default test that fails with a fault in a copy of the tree; empty if all pass."""
    path = copy / "bowdenfit" / fault.file
    text = path.read_text(encoding="utf-8")
    path.write_text(replace_line(fault, copy), encoding="utf-8")
    try:
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-x", "-q", "-n0", *fault.tests],
            cwd=copy, env=os.environ | {"PYTHONPATH": str(copy)}, capture_output=True, text=True, check=False,
        )  # fmt: skip
    finally:
        path.write_text(text, encoding="utf-8")
    failed = re.search(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE)
    return failed[1] if failed else ""


def main() -> None:
    """Try all faults."""
    unnoticed = 0
    with tempfile.TemporaryDirectory() as place:
        copy = copy_tree(Path(place) / "copy")
        for fault in FAULTS:
            test = noticed_by(fault, copy)
            unnoticed += not test
            print(f"{fault.description}: {test or 'UNNOTICED'}", flush=True)
    sys.exit(unnoticed > 0)


if __name__ == "__main__":
    main()
