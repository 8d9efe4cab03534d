"""Page of other people's measurements: what their authors printed next to what this program makes of their readings, compared.

    python scripts/published_measurements.py [--only DATA_SET ...]

writes `docs/evidence/measurements.md`. `datasets/published/printed.csv` has the values that authors print, each with the range
that is rounded to it or that they state, and the verdict expected of it. Each data set is fitted with seed 1. The verdict
follows from its 90 % interval, that of the first page, which includes errors of the bench:

- differs: the fit is not trusted (exit code 3), or its interval does not contain the printed value, or, where the authors
  state a range, has no value in common with it;
- wider: it does, and is more than `WIDER` times as wide as the printed range, that of rounding where none is stated;
- agrees: it does, and is not;
- no value: the authors print none, and the fit is trusted.

A row with another verdict than expected is named, and the script ends with 1. With `--only` these data sets are compared, and
nothing is written.
"""

import argparse
import csv
import sys
from dataclasses import dataclass
from math import exp, radians
from pathlib import Path

import bowdenfit as bf
from bowdenfit.finished_fit import Fit
from bowdenfit.questions.error_budget import answer_interval
from bowdenfit.words import significant

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "evidence" / "measurements.md"
PRINTED = ROOT / "datasets" / "published" / "printed.csv"
WIDER = 3  # times the printed range; a judgement

# By data set: title, source, what was measured, what its authors concluded, and why bowdenfit says otherwise or more.
TABLES = {
    "on-body-exoskeleton": (
        "Bowden cable of a knee exoskeleton",
        "*Force Transmission Analysis and Optimization of Bowden Cable on Body in a Flexible Exoskeleton* (2022): table "
        "1, section 3.2.1",
        "wrap angles at 13 lengths, efficiencies at four",
        "Three coefficients, each from a test of its own; the best length is 475 mm.",
        "The paper's coefficients do not give its own 67.8 % at 550 mm; the four efficiencies fit better with less "
        "friction in the squeezed sheath and more at the bracket edge. Four readings leave the intervals wide.",
    ),
    "yarn-on-cylinder": (
        "Cotton yarn on a metal cylinder",
        "github.com/cathaypacific8747/phy-mini-ia, workbook `master.xlsx`",
        "held force at seven measured angles, three trials each",
        "Not seen: the workbook has readings and no coefficient.",
        "",
    ),
    "published/carabiner-raise": (
        "Climbing rope over a carabiner, raised",
        "Over The Edge Rescue, *Pulley versus carabiner efficiency* (2016): section 3, carabiner results",
        "largest force of five raises of 10 kg",
        "The efficiency is 53 %, the load over the mean of the five.",
        "Readings of 0.18 and 0.20 kN are one increment of the cell apart, at the same load. With one load only, a larger "
        "reading is taken for both a larger load and a larger loss. The median is the authors' value.",
    ),
    "published/pulley-raise": (
        "Climbing rope over a small pulley, raised",
        "the same page: section 3, pulley results",
        "largest force of five raises of 10 kg",
        "The efficiency is 83 %.",
        "Five equal readings, to an increment of a sixth of their value, are one reading, of one mounting.",
    ),
    "published/carabiner-both-ways": (
        "Rope over a carabiner, raised, held and lowered",
        "Canyons and Crags, *Fun with Friction*: Carabiner as Pulley",
        "force at the anchor, to 1 lb, less the load of 11 lb",
        "Friction is a disadvantage in raising and an advantage in lowering. That the carabiner holds the load with the "
        "same force as the pulley surprised the author.",
        "A reading at rest is anywhere inside the friction band, so the two may well be equal: bowdenfit reads it as `hold`.",
    ),
    "published/pulley-both-ways": (
        "Rope over a pulley, raised, held and lowered",
        "Canyons and Crags, *Fun with Friction*: Efficient Pulley",
        "force at the anchor, to 1 lb, less the load of 11 lb",
        "The pulley is rated at around 92 %.",
        "The rating is the maker's, the readings are at 11 lb: 13 lb to raise and 8 lb to lower are 85 and 73 %. At so "
        "small a load the bearing and the stiffness of the rope, which do not grow with the load, count for more.",
    ),
    "published/dyneema": (
        "Dyneema braid over one carabiner, two carabiners and a pulley",
        "hwstock.org, Samson Amsteel Blue of 1/8 inch: The results",
        "efficiency of each over 180 deg",
        "60, 48 and 89 %. By the capstan equation one and two carabiners should not differ, which surprised the author.",
        "The values are given, so they come out; the intervals say what one mounting each is worth. Those of one "
        "carabiner and of two have no value in common, so the author's surprise is not an accident of the readings.",
    ),
    "published/rope-on-tubes": (
        "Ropes on tubes, bars, timber and concrete",
        "R. Delaney, *Physics for Roping Technicians* (RopeLab, 2022): page 88",
        "force to raise and to lower 75 kg, for 14 combinations of rope, surface and angle",
        "A coefficient for each line, from the ratio of both forces, which needs no load: 0.14 to 0.44. Of the same rope and "
        "surface it is larger at 90 than at 180 deg.",
        "With the load of 75 kg the two strokes contradict each other: raising takes too little, lowering too little as "
        "well, as if only 46 to 70 kg had hung there. The ratio hides that.",
    ),
    "published/rope-on-tubes-ratio": (
        "The same, without the load",
        "the same table",
        "force to raise against force to lower, over twice the angle",
        "The same coefficients.",
        "By the authors' own way the values come out. Each line is one mounting, so a coefficient is known to 10 to 50 "
        "%. Over the aluminium tubes one coefficient does not give both angles: those at 90 deg are above the "
        "interval of both together.",
    ),
    "published/timber": (
        "Lanyard over a rounded timber",
        "masterblasterhome.com, thread 26054, page 2",
        "two load cells at the moment of the largest force, read by the author off his figure: about 250 and 120 lb; the "
        "reading error, 5 lb, is noise",
        "The coefficient is 0.22, by a ratio of 2.",
        "250 to 120 is a ratio of 2.1; the rest is one mounting.",
    ),
    "published/paracord": (
        "Paracord on a pine roller",
        "igkt.net, topic 6933, first post",
        "lever ratio at which a board still held, 14, and at which it had slid, 19, over 3 pi",
        "The coefficient is between 0.28 and 0.31.",
        "",
    ),
    "published/lowering-bollard": (
        "Rope on the bollard of a lowering device",
        "Arbpro LD2, manual, page 27",
        "80, 400 and 800 kg held with 3/4, 2 3/4 and 3 3/4 wraps of a new 12 mm rope; the hand's force is not "
        "printed and cancels",
        "More wraps hold more; no coefficient is printed.",
        "Five times for two turns and ten times for three are the same coefficient, as the capstan equation has it.",
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Comparison:
    """A printed value next to the interval of a fit.

    Args:
        printed: Row of `printed.csv`.
        interval: Median and 90 % interval in the unit of the printed value; None where nothing is printed.
        trusted: Whether the fit is.
    """

    printed: dict[str, str]
    interval: tuple[float, float, float] | None
    trusted: bool

    @property
    def verdict(self) -> str:
        """The verdict, by the rule at the top of this file."""
        if not self.trusted:
            return "differs"
        if self.interval is None:
            return "no value"
        _, low, high = self.interval
        least, most = float(self.printed["low"]), float(self.printed["high"])
        first, _, last = self.printed["printed"].partition(" to ")
        if high < float(first) or float(last or first) < low:
            return "differs"
        return "wider" if high - low > WIDER * (most - least) else "agrees"

    @property
    def fault(self) -> str:
        """That it comes out otherwise than expected; empty where it does not."""
        if self.verdict == self.printed["verdict"]:
            return ""
        name = f"{self.printed['data_set']} {self.printed['parameter']}".strip()
        return f"{name}: {self.verdict}, where {self.printed['verdict']} is expected"

    @property
    def cells(self) -> tuple[str, ...]:
        """Cells of the table on the page."""
        row, mark = self.printed, "" if self.trusted else " (not trusted)"
        unit = "" if row["as"] == "mu" else f" {row['as']}"
        name = f"efficiency, {row['parameter']} at {row['at_deg']} deg" if row["at_deg"] else row["parameter"]
        if self.interval is None:
            return "-", row["place"], "-", f"{self.verdict}{mark}"
        middle, low, high = (significant(value, 3) for value in self.interval)
        return (
            name,
            f"{row['printed']}{unit} ({row['place']})",
            f"{middle}{unit}, {low} to {high}",
            f"{self.verdict}{mark}",
        )


def interval_of(fit: Fit, row: dict[str, str]) -> tuple[float, float, float] | None:
    """Return median and 90 % interval of what a row is about, in its unit; None where the row has no value."""
    if not row["parameter"]:
        return None
    if row["parameter"] in ("best length", "efficiency at best"):
        best = fit.optimal_length()
        answer, scale = (best.length, 1.0) if row["as"] == "mm" else (best.efficiency, 100.0)
        return answer.median * scale, answer.q05 * scale, answer.q95 * scale
    answer = answer_interval(fit, row["parameter"])
    middle, low, high = answer.median, answer.q05, answer.q95
    if not row["at_deg"]:
        return middle, low, high
    angle = radians(float(row["at_deg"]))
    return 100 * exp(-middle * angle), 100 * exp(-high * angle), 100 * exp(-low * angle)


def compare(name: str, rows: list[dict[str, str]]) -> tuple[list[Comparison], str]:
    """Return the comparisons of a data set, and its verdict in the program's words."""
    fit = bf.fit(ROOT / "datasets" / name, seed=1)
    verdict = fit.verdict()
    comparisons = [Comparison(row, interval_of(fit, row), verdict.trusted) for row in rows]
    return comparisons, "" if verdict.trusted else " ".join(verdict.reasons)


def write_page(compared: dict[str, tuple[list[Comparison], str]]) -> None:
    """Write the page."""
    counts = [c.verdict for comparisons, _ in compared.values() for c in comparisons]
    lines = [
        "# Other people's measurements", "",
        "Published readings of ropes and cables, what their authors concluded, and what bowdenfit says. This page is made by "
        "`scripts/published_measurements.py`, which fits each data set with seed 1 and compares. *differs*: the fit is not "
        "trusted, or its 90 % interval (that of the first page, with errors of the bench) does not contain the printed "
        "value, or has no value in common with a printed range; "
        f"*wider*: it does, and is more than {WIDER} times as wide as what the authors state, or, where they state no "
        "uncertainty, as the rounding of their number; *agrees*: it does, and is not; *no value*: none was printed.", "",
        f"{len(compared) - 1} tables are here, one of them read in two ways. Of {len(counts)} comparisons "
        f"{counts.count('agrees')} agrees, {counts.count('wider')} are wider, {counts.count('differs')} differ, and "
        f"{counts.count('no value')} have no printed value. Nearly all are single mountings, printed without an "
        "uncertainty: the intervals say what such a number is worth.", "",
        "Only numbers that were seen in a source are typed in; see "
        "`datasets/published/README.md`.", "",
    ]  # fmt: skip
    for name, (comparisons, reasons) in compared.items():
        title, source, measured, concluded, reason = TABLES[name]
        lines += [f"## {title}", "", f"Data set `datasets/{name}`. Source: {source}. Measured: {measured}.", ""]
        lines += [f"The authors: {concluded}", ""]
        lines += ["| what | printed | bowdenfit, 90 % interval | verdict |", "| --- | --- | --- | --- |"]
        lines += ["| " + " | ".join(comparison.cells) + " |" for comparison in comparisons] + [""]
        lines += [f"bowdenfit does not trust the fit: {reasons}", ""] if reasons else []
        lines += [reason, ""] if reason else []
    PAGE.write_text("\n".join(lines), encoding="utf-8")


def main() -> int:
    """Fit everything, compare, and write the page; return 1 where a verdict is another than expected."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=list(TABLES), help="compare these, and write nothing")
    options = parser.parse_args()
    with PRINTED.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    compared = {
        name: compare(name, [row for row in rows if row["data_set"] == name]) for name in options.only or TABLES
    }
    faults = [
        comparison.fault for comparisons, _ in compared.values() for comparison in comparisons if comparison.fault
    ]
    for fault in faults:
        print(f"Comes out otherwise than expected: {fault}", file=sys.stderr)
    if not options.only:
        write_page(compared)
        print(f"Wrote {PAGE.relative_to(ROOT)}.")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
