"""Fit the data sets again and replace what the repository shows of them: `fits/published`, and what README.md says is printed.

    python scripts/publish.py

Takes some minutes. Everything is fitted with seed 1, so that on the same machine and with the same versions nothing changes.
Look at what changed before committing it: each number that did is a change of the program.
"""

import re
import shutil
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PUBLISHED = ROOT / "fits" / "published"
FIRST = "on-body-exoskeleton"
FITS = {  # data set: its figure, further files
    FIRST: ("efficiency", ("summary.json", "fit.json")),
    "synthetic-recordings": ("recordings", ()),
    "synthetic-haptic-loop": ("bending_loss", ()),
    "synthetic-catheter": ("motor_force", ()),
}
BLOCK = re.compile(r"(?<=It prints:\n\n```text\n).*?(?=```\n)", re.DOTALL)


def main() -> None:
    """Fit, copy, and put the summary into README.md."""
    with tempfile.TemporaryDirectory() as place:
        for name, (figure, further) in FITS.items():
            publish(name, Path(place) / name, figure, further)
        compare(Path(place))
    replace_printed()


def publish(name: str, fitted: Path, figure: str, further: tuple[str, ...]) -> None:
    """Fit a data set and keep its summaries and a figure."""
    import bowdenfit as bf

    bf.fit(ROOT / "datasets" / name, output=fitted, seed=1)
    kept = PUBLISHED / name
    shutil.rmtree(kept, ignore_errors=True)
    (kept / "figures").mkdir(parents=True)
    for file in ("summary.txt", "details.txt", *further):
        shutil.copy(fitted / file, kept / file)
    draw_small(fitted / "figures" / f"{figure}.png", kept / "figures" / f"{figure}.png")


def draw_small(source: Path, target: Path) -> None:
    """A figure in 256 colors, a third of its size."""
    from PIL import Image

    with Image.open(source) as image:
        image.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(target, optimize=True)


def compare(place: Path) -> None:
    """Whether friction of the recordings depends on the speed."""
    import bowdenfit as bf
    from bowdenfit.questions.compare.words import comparison_text

    name = "synthetic-recordings"
    rate = bf.fit(ROOT / "datasets" / name, friction="rate-dependent", seed=1)
    found = bf.compare({"plain": bf.load(place / name), "rate": rate})
    (PUBLISHED / name / "comparison.txt").write_text(comparison_text(found), encoding="utf-8")


def replace_printed() -> None:
    """What README.md says that the first fit prints."""
    path = ROOT / "README.md"
    text, printed = path.read_text(encoding="utf-8"), (PUBLISHED / FIRST / "summary.txt").read_text(encoding="utf-8")
    changed, count = BLOCK.subn(lambda _: printed, text)
    if count != 1:
        sys.exit("README.md has no block behind 'It prints:'.")
    path.write_text(changed, encoding="utf-8")


if __name__ == "__main__":
    main()
