"""The one command that fits a file without a description, with options for columns that its headings do not name."""

import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bowdenfit.description.cable_parts import radius_setting
from bowdenfit.errors import DatasetError
from bowdenfit.files.headings import find_candidates, heading_of, split_brackets
from bowdenfit.files.pivot import find_pivot_headings
from bowdenfit.files.spellings import names_force
from bowdenfit.kinds.file_kind import BESIDE_FORCES, FORCES, find_stated_angle, guess_file_kind
from bowdenfit.kinds.lone_file import WRAP_ANGLE, FileColumn, LoneFile
from bowdenfit.recordings.channel_clocks import likely_clock_unit
from bowdenfit.units import ColumnSource, measures, multiple_of, weight_of
from bowdenfit.words import listed, shown

_SPREAD = re.compile(
    r"(?:^|[\W_])(?:sd|std|stdev|sem|unc|uncertainty|error|err|noise|dev|deviation)(?:$|[\W_])", re.IGNORECASE
)
_MOST_NAMED = 8  # judged: columns that may be meant instead, which are listed
_STEPS = 60  # judged: rows that are enough to see a clock rise in even steps
_BOTH_SIGNS = 0.2  # judged: share of positive readings above which, and of negative ones, a channel is no rope's
_UNEVEN = 3.0  # judged: largest step of a clock over its smallest


@dataclass(frozen=True)
class FitCommand:
    """A command that fits one file, and what it takes for granted.

    Args:
        path: The file.
        options: Its options with their arguments, such as ("--column", "input_force=Force 1:N").
        provided: Assumptions of the command, each as a clause.
        names_more: Whether it names columns that the user has not.
        missing: Quantities that it needs and no column can be.
    """

    path: Path
    options: tuple[tuple[str, str], ...]
    provided: tuple[str, ...] = ()
    names_more: bool = False
    missing: tuple[str, ...] = ()

    @property
    def parts(self) -> list[str]:
        """The command as it can be pasted, in parts between which a line may end."""
        return [f"bowdenfit fit {shlex.quote(str(self.path))}", *map(_write_option, self.options)]

    @property
    def text(self) -> str:
        """The command as it can be pasted."""
        return " ".join(self.parts)

    def arguments(self, option: str) -> tuple[str, ...]:
        """Return the arguments of one of its options, such as "--column"."""
        return tuple(argument for name, argument in self.options if name == option)

    def with_options(self, option: str, arguments: Sequence[object]) -> "FitCommand":
        """Return the command with an option more for each argument."""
        return replace(self, options=(*self.options, *((option, str(argument)) for argument in arguments)))


def _write_option(option: tuple[str, str]) -> str:
    """Return an option as it can be pasted into a shell."""
    name, argument = option
    quantity, equals, heading = argument.partition("=") if name in ("--column", "--channel") else ("", "", argument)
    return f"{name} {quantity}{equals}{shlex.quote(heading)}"


def _naming(quantity: str, heading: str, unit: str = "") -> str:
    """Return the argument that names the column of a quantity, and its unit."""
    return f"{quantity}={heading}" + (f":{unit}" if unit else "")


def make_commands(file: LoneFile) -> list[FitCommand]:
    """Make the command that fits a file; both where it could be a table or a recording, in this order."""
    return [command.with_options("--sheet", [file.sheet] if file.sheet else []) for command in _make_commands(file)]


def _make_commands(file: LoneFile) -> list[FitCommand]:
    """Make the commands for a file, without its sheet."""
    if not file.kind.other:
        return [_make_recording_command(file) if file.recording else _make_table_command(file, file.kind.kind)]
    kind = file.kind.kind if file.kind.other == "recordings" else file.kind.other
    headings = [(column, heading_of(column.name, column.below)) for column in file.numbers if not column.is_index]
    channels = [replace(column, name=heading.name, below=heading.unit) for column, heading in headings]
    clocks = tuple(column for column in file.columns if column.is_clock)
    as_recording = replace(file, columns=(*clocks, *channels))
    return [_make_table_command(file, kind, always=True), _make_recording_command(as_recording, always=True)]


def _make_table_command(file: LoneFile, kind: str, always: bool = False) -> FitCommand:
    """Make the command that fits a table.

    Args:
        file: The table.
        kind: Name of the kind of measurement.
        always: Whether columns are named that say themselves what they are.
    """
    options, provided, missing = list[tuple[str, str]](), list[str](), list[str]()
    if file.table and find_pivot_headings(file.table.header) and not file.named:
        return FitCommand(file.path, ())
    if kind == "forces":
        named, labels = {**_find_columns_of_words(file), **file.named}, _find_labels(file)
        could_be = [column for column in file.numbers if column.name not in labels]
        in_order = bool(find_candidates(file.headings, BESIDE_FORCES)["stroke"])
        options, provided, missing = _name_forces(could_be, "--column", named, always, in_order)
    angle, of_angle = ([], []) if WRAP_ANGLE.name in file.named else _wrap_angle_options(file)
    names_more = any(name == "--column" for name, _ in (*angle, *options))
    renamed = _state_columns(file, "--column")
    return FitCommand(file.path, (*angle, *renamed, *options), (*of_angle, *provided), names_more, tuple(missing))


def _make_recording_command(file: LoneFile, always: bool = False) -> FitCommand:
    """Make the command that fits a recording; with `always` channels are named that say themselves what they are."""
    clock = None if file.has_clock or "time" in file.named else _find_unnamed_clock(file.signals)
    signals = [column for column in file.signals if column is not clock]
    options, provided, missing = _name_forces(signals, "--channel", file.named, always, in_order=True)
    if clock is not None:
        unit = likely_clock_unit(float(np.diff(clock.values[:_STEPS]).max()))
        options.append(("--channel", _naming("time", clock.name, unit)))
        provided.append(f"{shown(clock.name)} is the time in {unit}, as the file does not state")
    elif not file.has_clock and "time" not in file.named:
        options.append(("--channel", "time=1000Hz"))
        provided.append("1000 Hz is its sampling rate, which the file does not state")
    elif file.doubtful_clock and "time" not in file.named:
        counted = next(column for column in file.columns if column.name == file.doubtful_clock)
        unit = likely_clock_unit(float(np.nanmedian(np.diff(counted.values))))
        options.append(("--channel", _naming("time", file.doubtful_clock, unit)))
        provided.append(f"{shown(file.doubtful_clock)} is in {unit}, as the file does not state")
    angle, of_angle = _stated_angle_options(file)
    renamed = _state_columns(file, "--channel")
    return FitCommand(file.path, (*angle, *renamed, *options), (*of_angle, *provided), missing=tuple(missing))


def _find_unnamed_clock(columns: Sequence[FileColumn]) -> FileColumn | None:
    """Return the first column that rises in even steps as a clock does, and states no unit; None without one."""
    for column in columns:
        steps = np.diff(column.values[:_STEPS])
        rises = len(steps) > 1 and steps.min() > 0 and steps.max() < _UNEVEN * steps.min()
        if rises and not column.written_unit and not column.is_index:
            return column
    return None


def _name_forces(
    columns: Sequence[FileColumn],
    option: str,
    named: Mapping[str, ColumnSource],
    always: bool = False,
    in_order: bool = False,
) -> tuple[list[tuple[str, str]], list[str], list[str]]:
    """Return the options that name the forces at both ends, what they take for granted, and ends that no column can be.

    Args:
        columns: Columns or channels of numbers.
        option: "--column" or "--channel".
        named: Columns that the user has named, by quantity.
        always: Whether forces are named that say themselves what they are.
        in_order: Whether the first of two unnamed forces is taken for the input, rather than the larger: over both strokes the
            output is the larger one on average.
    """
    columns = [column for column in columns if column.name not in [source.name for source in named.values()]]
    can_be = find_candidates([(column.name, column.below) for column in columns], FORCES, tuple(named))
    ends = {name: columns[candidates[0].position] for name, candidates in can_be.items() if candidates}
    sure = {name for name, candidates in can_be.items() if len(candidates) == 1}
    unnamed = [quantity.name for quantity in FORCES if quantity.name not in named]
    current = _find_current(columns) if "input_force" in unnamed and "input_force" not in ends else None
    ends |= {} if current is None else {"input_force": current}
    missing = [name for name in unnamed if name not in ends]
    remaining = _forces_among([column for column in columns if column not in ends.values()], len(missing))
    best = remaining[: len(missing)]
    best = best if in_order else sorted(best, key=lambda column: -column.mean)  # a pulled cable loses force
    ends |= dict(zip(missing, best, strict=False))
    as_force = [name for name in missing if name in ends and not measures(ends[name].written_unit, "torque")]
    provided = [f"{shown(ends[name].name)} is the {name}" for name in as_force]
    if provided and len(remaining) > len(best):
        also = listed([shown(column.name) for column in remaining[len(best) :][:_MOST_NAMED]])
        provided[-1] += f" rather than {also}"
    if not missing and len(sure) < len(unnamed):
        provided += [f"{shown(ends[name].name)} is the {name}" for name in ends if name not in sure]
    unnamed = [name for name in unnamed if name in ends]
    multiples = {name: multiple for name in unnamed if (multiple := multiple_of(split_brackets(ends[name].name)[1]))}
    for name, (factor, unit) in multiples.items():
        provided.append(f"the numbers under {shown(ends[name].name)} are multiplied by {factor} and headed ({unit})")
    options = []
    for name in [name for name in unnamed if name not in multiples]:
        unit = weight_of(ends[name].written_unit) or ("" if ends[name].written_unit else "N")
        if measures(ends[name].written_unit, "torque"):
            end = name.removesuffix("_force")
            options += [(option, _naming(f"{end}_torque", ends[name].name)), ("--set", radius_setting(end))]
            provided.append(f"{shown(ends[name].name)} is the torque of a pulley of 15 mm at the {end}")
        elif ends[name] is current:
            settings = 'motor.torque_constant={value=0.05,unit="N*m/A"}', radius_setting("input")
            options += [(option, _naming("input_current", ends[name].name)), *(("--set", setting) for setting in settings)]
            provided.append(f"{shown(ends[name].name)} is the current of a motor of 0.05 N m/A with a pulley of 15 mm")
        elif always or unit or name not in sure:
            options.append((option, _naming(name, ends[name].name, unit)))
    if any(not column.written_unit for name, column in ends.items() if name not in multiples):
        provided.append("the forces are in newtons, as the file does not state")
    return options, provided, [name for name in missing if name not in ends]


def _find_current(columns: Sequence[FileColumn]) -> FileColumn | None:
    """Return the only column of a current where one other can be a force: a motor's; two are signals of load cells."""
    currents = [column for column in columns if measures(column.written_unit, "current")]
    forces = _forces_among([column for column in columns if column not in currents], len(FORCES))
    return currents[0] if len(currents) == 1 and len(forces) == 1 else None


def _forces_among(columns: Sequence[FileColumn], least: int) -> list[FileColumn]:
    """Return the columns that can be forces, the likeliest first: in units of force, of weight, of torque, none, of signals.

    Args:
        columns: Columns of numbers.
        least: Number of columns from which unlikelier ones are left out.
    """
    units = {column.name: column.written_unit for column in columns}
    measured = [column for column in columns if not (_SPREAD.search(column.name) or column.is_index)]
    of_force = [column for column in measured if measures(column.written_unit, "force")]
    of_torque = [column for column in measured if measures(column.written_unit, "torque")]
    of_weight = [column for column in measured if weight_of(units[column.name])]
    without_unit = [column for column in measured if not units[column.name]]
    signals = [column for column in measured if units[column.name] and column.dimension in ("", "other", "ratio", "current")]
    likely = list[FileColumn]()
    for group in (of_force, of_weight, of_torque, without_unit, [column for column in signals if column not in of_weight]):
        likely += _likeliest_first(group, least) if len(likely) < least else []
    return likely


def _likeliest_first(columns: Sequence[FileColumn], least: int) -> list[FileColumn]:
    """Return columns with those last that cannot be forces by their numbers or, if others can be by theirs, by their names."""
    named = [column for column in columns if names_force(column.name)]
    by_name = named if len(named) >= least else columns
    return sorted(columns, key=lambda column: (not _pulls(column), column not in by_name))


def _pulls(column: FileColumn) -> bool:
    """Return whether the numbers of a column may be forces of a rope, which only pulls, rather than noise or a counter."""
    if len(column.finite) < _STEPS:
        return True
    positive = np.count_nonzero(column.finite > 0) / len(column.finite)
    return not _BOTH_SIGNS < positive < 1 - _BOTH_SIGNS and not bool(np.all(np.diff(column.finite) == 1))


def make_ambiguity_error(file: LoneFile) -> DatasetError:
    """Return the refusal of a file that could be a table or a recording."""
    of_table, of_recording = make_commands(file)
    return DatasetError(
        f"{file.path.name} could be a table of readings or a recording: {file.kind.why}; say which, for a table by "
        f"{of_table.text}, for a recording by {of_recording.text}."
    )


def require_recordings(paths: Sequence[Path], has_channels: bool, named: Sequence[str]) -> None:
    """Refuse files of two loggers that are no recordings.

    Raises:
        DatasetError: One is a table of readings; says how to join it.
    """
    if named:
        raise DatasetError(
            f"--column names columns of a table, and {paths[1].name} is joined to a recording, whose channels are named by "
            "--channel; put two tables of readings into one by hand, a row for each reading."
        )
    for path in paths:
        guess = guess_file_kind(path, has_channels)
        if guess.kind != "recordings":
            raise DatasetError(
                f"{path.name} is a table of readings and no recording, because {guess.why}; put both forces into one table by "
                "hand, a row for each reading with the force at both ends. Only recordings are joined by their clocks."
            )


def _find_columns_of_words(file: LoneFile) -> dict[str, ColumnSource]:
    """Find forces whose columns hold no numbers, so that no other column is taken for them."""
    are_numbers = {column.name for column in file.numbers}
    names_of = {
        name: [file.headings[column.position][0] for column in columns]
        for name, columns in find_candidates(file.headings, FORCES).items()
    }
    return {
        name: ColumnSource(name=names[0]) for name, names in names_of.items() if names and not are_numbers.intersection(names)
    }


def _find_labels(file: LoneFile) -> set[str]:
    """Find columns whose headings say that they are not forces, such as the label of a run."""
    candidates = find_candidates(file.headings, BESIDE_FORCES)
    return {file.headings[columns[0].position][0] for columns in candidates.values() if len(columns) == 1}


def _wrap_angle_options(file: LoneFile) -> tuple[list[tuple[str, str]], list[str]]:
    """Return options that give the wrap angle of a table, and what they assume."""
    if file.wrap_angle_heading:
        return [], []
    likely = file.likely_wrap_angles
    if not likely:
        return _stated_angle_options(file)
    best = next((name for name in likely if "measured" in name.lower()), next(iter(likely)))
    remaining = [shown(name) for name in likely if name != best]
    rather = f" rather than {listed(remaining)}, and not one of several bends, whose angles add up" if remaining else ""
    unit, clause = likely[best], f"{shown(best)} is the wrap angle{rather}"
    if unit is None:
        return [], [f"the table has a column wrap_angle_deg, the number of bends in {shown(best)} times the angle of one"]
    return [("--column", _naming("wrap_angle", best, unit))], [clause + (f", in {unit}" if unit else "")]


def _state_columns(file: LoneFile, option: str) -> list[tuple[str, str]]:
    """Return the options that the user has stated."""
    return [(option, _naming(quantity, source.name, source.unit or "")) for quantity, source in file.named.items()]


def _stated_angle_options(file: LoneFile) -> tuple[list[tuple[str, str]], list[str]]:
    """Return the option for one wrap angle, as a channel or the file states it or as an example, and what it assumes."""
    measured = (file.angle.option, f"the channel {shown(file.angle.name)}") if file.angle else None
    stated_angle = measured or find_stated_angle(file.path)
    if stated_angle is None:
        return [("--wrap-angle", "180deg")], ["180 deg is the wrap angle of the bench"]
    angle, source = stated_angle
    return [("--wrap-angle", angle)], [f"{angle} is the wrap angle, as {source} says"]
