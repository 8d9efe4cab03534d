"""Strokes of a table as people write them: pull, return and hold in five languages, and pairs of opposite words.

Words such as "up" and "down" do not say which of them pulls. The forces do, because friction never lets more out than in:
the stroke in which less arrives at the output is the pull.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from bowdenfit.files.cells import Cell
from bowdenfit.files.columns import Column
from bowdenfit.files.spellings import without_accents
from bowdenfit.types import Labels, Vector
from bowdenfit.words import shown

_STROKE_WORDS = {
    1: "pull pulling pulled +1 1 +1.0 1.0 loading ziehen zug hub belasten belastung tirer traction charge tirar traccion carga "
    "tirare trazione carico tighten tightening tensioning spannen anziehen heben",
    -1: "return returning release releasing -1 -1.0 unloading zuruck zurueck ruckhub rueckhub nachlassen entlasten entlastung "
    "retour relacher decharge retorno vuelta soltar descarga ritorno rilascio scarico loosen loosening slackening "
    "entspannen loslassen senken",
    0: "hold held holding 0 0.0 halten gehalten maintien tenir mantener tenere static stationary",
}
_STROKES = {word: stroke for stroke, words in _STROKE_WORDS.items() for word in words.split()}
_OPPOSITES = (
    "up/down u/d upward/downward upwards/downwards upstroke/downstroke ↑/↓ auf/ab raise/lower lift/lower in/out inward/outward "
    "inwards/outwards inbound/outbound instroke/outstroke rein/raus ein/aus forward/backward forward/back forward/reverse "
    "forward/return forwards/backwards fwd/rev fwd/bwd fwd/back f/b f/r p/r forth/back there/back go/return move/return "
    "out/return outward/return hin/her hin/zuruck hin/zurueck vor/zuruck vor/zurueck vor/ruck vorwarts/ruckwarts "
    "vorwaerts/rueckwaerts aller/retour ida/vuelta andata/ritorno haut/bas montee/descente avant/arriere arriba/abajo "
    "adelante/atras su/giu avanti/indietro pull/push pull/relax pull/slack extend/retract extension/retraction "
    "extending/retracting advance/retract flexion/extension open/close opening/closing increasing/decreasing "
    "increase/decrease inc/dec rising/falling ascending/descending positive/negative pos/neg +/- cw/ccw "
    "clockwise/counterclockwise clockwise/anticlockwise wind/unwind winding/unwinding load/unload contraction/relaxation "
    "tension/release"
)
_PAIRS = {frozenset(pair.split("/")) for pair in _OPPOSITES.split()}
_HELD = ", or hold (0, read while nothing slides)"
_CLEAR = 0.9  # judged: share of pairs of readings, one of either stroke, in which the same stroke loses more force


def read_strokes(columns: Mapping[str, Column], n_rows: int, held: str = _HELD) -> Labels:
    """Return the strokes of a table; all pulling without a column.

    Args:
        columns: Columns of the table.
        n_rows: Number of its rows.
        held: Clause about held readings for a refusal; empty if the table may have none.
    """
    if "stroke" not in columns:
        return np.ones(n_rows, dtype=int)
    return np.array(columns["stroke"].read_cells(lambda cell: read_stroke(cell, held), 1))


def read_strokes_by_loss(columns: Mapping[str, Column], loss: Vector) -> tuple[Labels, list[str]]:
    """Return the strokes of a table of forces, and a remark where the forces told which of two words is the pull.

    Args:
        columns: Columns of the table.
        loss: log(F_in/F_out) of each row; NaN where it cannot be read.
    """
    column = columns.get("stroke")
    pair = _opposite_words(column.cells) if column else None
    if column is None or pair is None:
        return read_strokes(columns, len(loss)), []
    one, other = pair
    stroke = _STROKES.get(one) or -_STROKES.get(other, 0)
    remark = list[str]()
    if not stroke:
        words = np.array([_plain_word(cell) for cell in column.cells])
        runs = np.array([cell.text.strip() for cell in columns["run"].cells] if "run" in columns else [""] * len(loss))
        share = _share_of_greater_loss(loss, words == one, words == other, runs)
        if 1 - _CLEAR < share < _CLEAR:
            return np.array(column.read_cells(lambda cell: _undecided(cell, one, other), 1)), []
        stroke = 1 if share > 0.5 else -1
        written = {_plain_word(cell): cell.shown for cell in column.cells}
        pull, back = (written[word] for word in (one, other)[::stroke])
        remark = [
            f"{column.cells[0].file}: the stroke {pull} is taken for pull and {back} for return, because "
            f"{pull} transmits less of the force."
        ]
    strokes = {**_STROKES, one: stroke, other: -stroke}
    return np.array(column.read_cells(lambda cell: read_stroke(cell, _HELD, strokes), 1)), remark


def _opposite_words(cells: Sequence[Cell]) -> tuple[str, str] | None:
    """Return the two words of a column where they are known opposites, and not both say which stroke they are."""
    words = [word for word in dict.fromkeys(map(_plain_word, cells)) if _STROKES.get(word) != 0]
    if len(words) != 2 or frozenset(words) not in _PAIRS or all(word in _STROKES for word in words):
        return None
    return words[0], words[1]


def _share_of_greater_loss(loss: Vector, first: np.ndarray, second: np.ndarray, runs: np.ndarray) -> float:
    """Return in which share of pairs, of one reading of each word in one run, the first word's loses more; else one half.

    Where no run has both words, readings of all runs are paired.
    """
    both = [run for run in dict.fromkeys(runs) if np.any(first & (runs == run)) and np.any(second & (runs == run))]
    groups = [runs == run for run in both] or [np.ones(len(loss), dtype=bool)]
    below = [np.searchsorted(np.sort(loss[second & rows]), loss[first & rows]) for rows in groups]
    pairs = sum(np.sum(first & rows) * np.sum(second & rows) for rows in groups)
    return float(sum(map(np.sum, below)) / pairs) if np.all(np.isfinite(loss)) else 0.5


def _plain_word(cell: Cell) -> str:
    text = without_accents(cell.text.strip().lower().replace("\u2212", "-").replace(",", "."))
    return text.replace("stroke", "").strip(" -") or text if text.endswith("stroke") else text


def read_stroke(cell: Cell, held: str = _HELD, strokes: Mapping[str, int] = _STROKES) -> int:
    """Return the stroke that a cell says: 1 of a pull, -1 of a return, 0 where the rope was held.

    Args:
        cell: The cell.
        held: Clause about held readings for a refusal.
        strokes: Known words, and the stroke of each.
    """
    word = _plain_word(cell)
    if word not in strokes:
        raise cell.refuse(
            f"{cell.shown} is not a stroke; write pull (+1) or return (-1){held}; rename a column that holds something else."
        )
    return strokes[word]


def _undecided(cell: Cell, one: str, other: str) -> int:
    if _plain_word(cell) in (one, other):
        raise cell.refuse(
            f"{cell.shown} does not say whether the rope is pulled, and the forces do not either, because neither {shown(one)} "
            f"nor {shown(other)} loses more of the force throughout; write pull (+1) or return (-1)."
        )
    return 0
