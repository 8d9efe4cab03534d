"""Compare the numbers of every golden text with those at an earlier commit: words may change, numbers may not.

    .venv/bin/python scripts/compare_golden_numbers.py COMMIT

Golden texts are what tests and the published example hold printed: `GOLDEN` below. For each the numbers in order are
compared, whatever stands between them. Exit code 0: all are equal; 1: the differences are printed.
"""

import difflib
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
GOLDEN = (
    "tests/questions/summary/golden/*.txt",
    "tests/data_sets/golden.json",
    "fits/published/*/*.txt",
    "fits/published/*/summary.json",
    "fits/calibration/*/*.txt",
)
NUMBER = re.compile(r"#|(?<![\w.])[+-]?\d+(?:\.\d+)?(?:e[+-]?\d+)?")  # a mask, or no digit inside a name such as mu1


def git(*arguments: str) -> str:
    """Return what a command of Git prints."""
    return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True).stdout


def text_at(commit: str, path: Path) -> str:
    """Return the text of a file at a commit, or of the only file of its name there; empty where there was none."""
    files = git("ls-tree", "-r", "--name-only", commit).splitlines()
    same_name = [file for file in files if Path(file).name == path.name]
    earlier = [str(path)] if str(path) in same_name else same_name
    return git("show", f"{commit}:{earlier[0]}") if len(earlier) == 1 else ""


def main() -> int:
    if len(sys.argv) != 2:
        print("Name the commit to compare with, such as HEAD~1.", file=sys.stderr)
        return 2
    differ = 0
    for path in sorted(path.relative_to(ROOT) for pattern in GOLDEN for path in ROOT.glob(pattern)):
        earlier, after = (NUMBER.findall(text) for text in (text_at(sys.argv[1], path), (ROOT / path).read_text("utf-8")))
        if not earlier:
            print(f"new    {path}")
        elif earlier == after:
            print(f"equal  {path}: {len(after)} numbers")
        else:
            differ += 1
            print(f"DIFFER {path}: {len(earlier)} numbers before, {len(after)} after")
            for change in difflib.unified_diff(earlier, after, "before", "after", lineterm="", n=2):
                print(f"       {change}")
    return int(differ > 0)


if __name__ == "__main__":
    sys.exit(main())
