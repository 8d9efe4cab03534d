"""Take the three pictures of the app in docs/files again: the answer of a fit, files on their way to a data set, and the trial.

    python scripts/app_pictures.py [--output FOLDER]

The on-body data set is fitted with seed 1, as the published fit is. The files are two tables and a workbook as a German bench
writes them, and a recording of `tests/support/recorded_benches.py`. Needs Debian's chromium and
pip install '.[app]' playwright.
"""

import argparse
import shutil
import sys
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from openpyxl import Workbook
from PIL import Image

import bowdenfit as bf

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests" / "support"))

from app_in_browser import Visit, served, visiting  # noqa: E402
from offline_browser import browser  # noqa: E402
from recorded_benches import RecordedBench, channels  # noqa: E402

ON_BODY = "on-body-exoskeleton"
HEIGHT, WIDE, NARROW = 1000, 1600, 1280  # pixels
HEADINGS = ("Kraft Motor (N)", "Kraft Last (N)", "Umschlingungswinkel (Grad)", "Montage")
COLORS = 128  # of a picture, which is less than half as large so
LOADS, MU = (20, 40, 60, 80), 0.12


def write_files(folder: Path) -> list[Path]:
    """Write what a German bench measured at 90, 180 and 270 deg, and a recording at 180 deg.

    Args:
        folder: Where to.
    """
    generator, files = np.random.default_rng(3), list[Path]()
    for degrees in (90, 180, 270):
        rows = []
        for mounting in (1, 2, 3):
            loss = np.exp(-MU * np.deg2rad(degrees) * (1 + 0.02 * generator.standard_normal()))
            outputs = np.array(LOADS) * loss + 0.2 * generator.standard_normal(len(LOADS))
            rows += [(load, round(float(out), 1), degrees, mounting) for load, out in zip(LOADS, outputs, strict=True)]
        if degrees < 270:
            lines = [";".join(HEADINGS), *(";".join(map(str, row)).replace(".", ",") for row in rows)]
            files.append(folder / f"Messung {degrees} Grad.csv")
            files[-1].write_text("\n".join([*lines, ""]), encoding="utf-8")
            continue
        book = Workbook()
        book.active.title = "Kräfte"
        for row in (HEADINGS, *rows):
            book.active.append(row)
        files.append(folder / f"Messreihe {degrees}.xlsx")
        book.save(files[-1])
    recorded = channels(RecordedBench(rate=100.0, length=60.0, exponent=MU * np.pi), generator)
    files.append(folder / "Aufnahme 180 Grad.csv")
    table = np.column_stack(list(recorded.values()))
    np.savetxt(files[-1], table, "%.7g", ",", header=",".join(recorded), comments="")
    return files


def take(visit: Visit, path: Path, width: int) -> None:
    """Write what a page shows first."""
    visit.page.set_viewport_size({"width": width, "height": HEIGHT})
    visit.page.wait_for_timeout(1000)
    visit.page.evaluate("() => { document.activeElement.blur(); window.scrollTo(0, 0); }")
    with Image.open(BytesIO(visit.page.screenshot())) as picture:
        picture.convert("RGB").quantize(COLORS).save(path, optimize=True)
    print(path)


def show_files(visit: Visit, files: list[Path]) -> None:
    """Add files to a new data set."""
    page = visit.page
    page.goto(f"{visit.root}/")
    page.get_by_role("button", name="New data set").click()
    page.set_input_files("input[type=file]", files)
    page.locator("#charts .uplot").first.wait_for()  # all that is asked has an answer that is proposed


def main() -> None:
    """Take the pictures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--output", type=Path, default=ROOT / "docs" / "files")
    output = parser.parse_args().output.resolve()
    with TemporaryDirectory() as place:
        folder = Path(place)
        shutil.copytree(ROOT / "datasets" / ON_BODY, folder / ON_BODY)
        bf.fit(folder / ON_BODY, output=folder / "fits" / ON_BODY, seed=1)
        (folder / "files").mkdir()
        files = write_files(folder / "files")
        with browser() as chromium, served(folder) as app, visiting(chromium, app, color_scheme="light") as visit:
            page = visit.page
            page.goto(f"{visit.root}/fit/{ON_BODY}")
            page.locator("#arrives p").first.wait_for()
            take(visit, output / "app-answer.png", WIDE)
            page.goto(f"{visit.root}/try/{ON_BODY}?fit={ON_BODY}")
            page.locator("#misfit span").wait_for()
            for _ in range(12):
                page.get_by_label("mu1", exact=True).press("ArrowRight")
            take(visit, output / "app-try.png", NARROW)
            show_files(visit, files)
            take(visit, output / "app-bring.png", NARROW)


if __name__ == "__main__":
    main()
