"""Fit the data sets again and replace what the repository shows of them: `fits/published`, and what pages say is printed.

    python scripts/publish.py
    python scripts/publish.py --pages

replaces, with `--pages`, only what README.md and the guides show behind a $, of fits as they are published; else everything,
which takes some minutes. Everything is fitted with seed 1, so that on the same machine and with the same versions nothing
changes. Look at what changed before committing it: each number that did is a change of the program. Reports are left out: that
of the first fit alone is 0.6 MB, much of which changes with any number; `bowdenfit report FIT` writes one.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]

import on_body_numbers  # noqa: E402
import quoted_sentences  # noqa: E402
import snippets  # noqa: E402

PUBLISHED = ROOT / "fits" / "published"
FIRST = "on-body-exoskeleton"
FITS = {  # data set: its figure, further files
    FIRST: ("efficiency", ("summary.json", "fit.json")),
    "synthetic-recordings": ("recordings", ()),
    "synthetic-haptic-loop": ("bending_loss", ()),
    "synthetic-catheter": ("motor_force", ()),
}


def main() -> None:
    """Fit, copy, and put what commands print into the pages."""
    with tempfile.TemporaryDirectory() as place:
        fits = Path(place) / "fits"
        for name, (figure, further) in FITS.items() if "--pages" not in sys.argv else ():
            publish(name, fits / name, figure, further)
        if "--pages" not in sys.argv:
            compare(fits)
            write_quoted_numbers(fits, Path(place))
        replace_printed(Path(place))
        print(*quoted_sentences.missing(), sep="\n")


def publish(name: str, fitted: Path, figure: str, further: tuple[str, ...]) -> None:
    """Fit a data set and keep its summaries and a figure."""
    import bowdenfit as bf

    bf.fit(ROOT / "datasets" / name, output=fitted, seed=1)
    folder = PUBLISHED / name
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "figures").mkdir(parents=True)
    for file in ("summary.txt", "details.txt", *further):
        shutil.copy(fitted / file, folder / file)
    draw_small(fitted / "figures" / f"{figure}.png", folder / "figures" / f"{figure}.png")


def draw_small(source: Path, target: Path) -> None:
    """A figure in 256 colors, a third of its size."""
    from PIL import Image

    with Image.open(source) as image:
        image.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(target, optimize=True)


def compare(place: Path) -> None:
    """Whether friction of the recordings depends on the speed."""
    import bowdenfit as bf

    name = "synthetic-recordings"
    rate = bf.fit(ROOT / "datasets" / name, friction="rate-dependent", seed=1)
    comparison = bf.compare({"plain": bf.load(place / name), "rate": rate})
    (PUBLISHED / name / "comparison.txt").write_text(f"{comparison}\n", encoding="utf-8")


def write_quoted_numbers(fits: Path, place: Path) -> None:
    """Write the numbers that pages quote in sentences; those that quote others are printed at the end."""
    import bowdenfit as bf

    numbers = on_body_numbers.numbers(bf.load(fits / FIRST), place)
    text = json.dumps(numbers, indent=1, ensure_ascii=False)
    (PUBLISHED / FIRST / "quoted.json").write_text(f"{text}\n", encoding="utf-8")


def replace_printed(place: Path) -> None:
    """What README.md and the guides show behind a $; what leaves lines out is only compared.

    Args:
        place: Folder with the fits, in which the commands are run.
    """
    (place / "datasets").symlink_to(ROOT / "datasets")
    for file in (ROOT / "docs" / "files").iterdir():
        shutil.copy(file, place)
    for block in snippets.blocks("console"):
        for words, shown in block.shown:
            printed = print_of(words, place)
            if printed is None or snippets.as_shown(shown, printed):
                continue
            if snippets.ELISION in shown.splitlines():
                print(f"{block}: {' '.join(words)} prints something else now:\n{printed}")
                continue
            text = block.page.read_text(encoding="utf-8")
            block.page.write_text(text.replace(shown, printed), encoding="utf-8")


def print_of(words: tuple[str, ...], place: Path) -> str | None:
    """What a command prints; None where its fit is not there."""
    if words in snippets.PUBLISHED:
        return snippets.PUBLISHED[words].read_text(encoding="utf-8")
    if any(word.startswith("fits/") and not (place / word).exists() for word in words):
        return None
    surroundings = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", *words]
    return subprocess.run(command, cwd=place, env=surroundings, capture_output=True, text=True, check=True).stdout


if __name__ == "__main__":
    main()
