"""Export of a fit: check what a format can express, and write it; CSV tables are built here."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar

from bowdenfit.csv_tables import csv_comment, csv_table
from bowdenfit.display import Display, Rows
from bowdenfit.errors import DatasetError, StoreError, UsageError
from bowdenfit.extensions import CONTROLLERS, EXPORTS, iterate_extensions, load_extension
from bowdenfit.questions.export.c import c_header
from bowdenfit.questions.export.matlab import function_name, matlab_function
from bowdenfit.questions.export.python import python_module
from bowdenfit.questions.export.tables import (
    DRAW,
    LEVELS,
    SUPPORTED_OPTIONS,
    TablePoints,
    TransmissionTables,
    tabulate_transmission,
)
from bowdenfit.questions.export.text import make_identifier, wrap_comment
from bowdenfit.questions.export.yaml import yaml_parameters
from bowdenfit.questions.predict.verb import predict
from bowdenfit.questions.summary.verdict import assess_for
from bowdenfit.results.folder import file_to_write
from bowdenfit.results.record import Record
from bowdenfit.units import conversion_factor, route_conversion_factor
from bowdenfit.words import listed


def lookup_table(fit: Record, tables: TransmissionTables) -> str:
    """Return efficiency with intervals by position, as `predict` gives it, and the friction exponent, as CSV.

    Args:
        fit: The fit.
        tables: Its tables.
    """
    points = tables.points.values
    if tables.points.unit == "rad":
        rows = predict(fit, quantity="efficiency", wrap_angles=[(float(angle), "rad") for angle in points])
    else:
        rows = predict(fit, [float(x) for x in points] if tables.points.unit else None, quantity="efficiency")
    heads = [*(name for name in rows[0] if name != "note"), *(f"friction_exponent_{x.name}" for x in tables.levels)]
    answers = [[value for name, value in row.items() if name != "note"] for row in rows]
    return _table_text(tables, heads, [[*row, *(x.exponent[0, i] for x in tables.levels)] for i, row in enumerate(answers)])


def draws_table(tables: TransmissionTables) -> str:
    """Return friction of every draw and position as CSV, each draw with a mounting of its own.

    Args:
        tables: The tables.
    """
    points = tables.points
    point_heading = [] if not points.unit else [f"{points.variable}_{points.unit}"]
    heads = ["draw", *point_heading, "friction_exponent_pull", "friction_exponent_return"]
    heads += ["taut_loss_N"] if tables.is_loop else []
    heads += ["load_exponent", "drag_N"] if tables.depends_on_load else []
    heads += (
        ["stribeck", f"stribeck_speed_{tables.speed_unit}", f"viscous_per_{tables.speed_unit}"]
        if tables.depends_on_rate
        else []
    )
    heads += ["presliding_stiffness", "bristle_damping_s"] if tables.builds_up else []
    rows: list[list[object]] = []
    for level in (level for level in tables.levels if level.name.startswith(DRAW)):
        for i, point in enumerate(points.values):
            place = [float(point)] if point_heading else []
            cells: list[object] = [level.name.removeprefix(DRAW), *place, *level.exponent[:, i]]
            cells += [level.taut_loss[i]] if tables.is_loop else []
            cells += [level.load_exponent, level.drag] if tables.depends_on_load else []
            cells += level.rate if tables.depends_on_rate else ()
            cells += level.presliding if tables.builds_up else ()
            rows.append(cells)
    return _table_text(tables, heads, rows)


def _table_text(tables: TransmissionTables, heads: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Return a table under what the tables say, with all digits of numbers."""
    return csv_comment(wrap_comment(tables.sentences)) + csv_table(heads, rows, number=lambda value: repr(float(value)))


def refuse_inexpressible(fit: Record, to: str, draws: int) -> None:
    """Refuse a cable that a format cannot express.

    Args:
        fit: The fit.
        to: The format.
        draws: Number of draws asked for.

    Raises:
        UsageError: It cannot; another that can is named.
    """
    export_format = load_formats()[to]
    supported = [name for name in SUPPORTED_OPTIONS if export_format.follows_turns or name not in ("dahl", "lugre")]
    unsupported = [name for name in fit.model.cable.friction.options if name not in supported]
    if unsupported and (to != "csv" or draws):
        raise UsageError(
            f"{export_format.words}{' of draws' if to == 'csv' else ''} cannot express the friction model "
            f"{listed(unsupported)}; export the lookup table instead, with --to csv, or a program that has a state for it, "
            "with --to c, matlab or python."
        )


def refuse_compensation(to: str) -> None:
    """Refuse a device for a format that does not write what may be compensated.

    Raises:
        UsageError: It does not.
    """
    if to != "yaml":
        raise UsageError(
            f"--device is for yaml only; {load_formats()[to].words} describes the cable alone. Leave it out, or write "
            "--to yaml."
        )


def convert_point(fit: Record, points: TablePoints, to: str, at: tuple[float, str] | None) -> float | None:
    """Convert the position of a format that holds at one to the unit of the tables; None if not given.

    Args:
        fit: The fit.
        points: Where friction is tabled.
        to: The format.
        at: What was said.

    Raises:
        UsageError: It has another unit, or the format holds everywhere, or friction is the same everywhere.
    """
    if at is None:
        return None
    formats = load_formats()
    if not formats[to].holds_at_one_point:
        of_one = listed([name for name, export_format in formats.items() if export_format.holds_at_one_point])
        raise UsageError(f"--at is asked of {of_one}; {formats[to].words} has tables over the whole range. Leave it out.")
    if not points.unit:
        raise UsageError("friction of this cable is the same everywhere; leave --at out.")
    route = fit.dataset.description.route
    try:
        factor = conversion_factor(at[1], "angle") if route is None else route_conversion_factor(at[1], route.unit)
    except DatasetError as error:
        raise UsageError(f"--at {at[0]:g}{at[1]}: {error}.") from None
    return at[0] * factor


@dataclass(frozen=True, repr=False)
class ExportedFile(Display):
    """A file written for another program.

    Args:
        file: The file.
        format: Its format.
        says: What it says at its top.
        trusted: Whether the fit may be trusted.
        remarks: What the format does not hold, or what else was to be known.
    """

    file: Path
    format: str
    says: tuple[str, ...]
    trusted: bool
    remarks: tuple[str, ...] = ()

    JSON: ClassVar = (("file", "_path"), "format", "says", "trusted", "remarks")

    def _path(self) -> str:
        return str(self.file)

    def __str__(self) -> str:
        return "\n".join(self.sentences())

    def sentences(self) -> list[str]:
        """Return the file, and remarks on it."""
        return [f"Wrote {self.file}.", *self.remarks]

    def _table(self) -> Rows:
        return [{"file": str(self.file), "format": self.format}], {}


@dataclass(frozen=True)
class ExportRequest:
    """Request of a file: what is to be written, and where.

    Args:
        fit: The fit.
        tables: Its tables.
        path: The file.
        point: Where a format that holds at one place does; None for the middle of the range.
        compensation: What may be compensated, by name; None where that was not asked.
    """

    fit: Record
    tables: TransmissionTables
    path: Path
    point: float | None
    compensation: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class FileContent:
    """Content of a file, and remarks on it."""

    content: bytes
    remarks: tuple[str, ...] = ()


def _write_c(request: ExportRequest) -> FileContent:
    return FileContent(c_header(request.tables).encode("ascii"))


def _write_csv(request: ExportRequest) -> FileContent:
    has_draws = len(request.tables.levels) > len(LEVELS)
    text = draws_table(request.tables) if has_draws else lookup_table(request.fit, request.tables)
    return FileContent(text.encode())


def _write_matlab(request: ExportRequest) -> FileContent:
    return FileContent(matlab_function(request.tables, function_name(request.path)).encode("ascii"))


def _write_python(request: ExportRequest) -> FileContent:
    return FileContent(python_module(request.tables).encode("ascii"))


def _write_yaml(request: ExportRequest) -> FileContent:
    return FileContent(yaml_parameters(request.tables, request.compensation).encode("ascii"))


@dataclass(frozen=True)
class ExportFormat:
    """A format of another program; those of add-ons are found by their entry points, under the name behind --to.

    Args:
        words: What a file of it is called.
        ending: Of its files.
        write: Makes the content of one.
        follows_turns: Whether it has friction that builds up after a turn.
        callback_ending: Ending of a file that calls back, where the format has such a one, too.
        holds_at_one_point: Whether its files hold at one wrap angle or length.
    """

    words: str
    ending: str
    write: Callable[[ExportRequest], FileContent]
    follows_turns: bool = False
    callback_ending: str = ""
    holds_at_one_point: bool = False


_FORMATS: Mapping[str, ExportFormat] = MappingProxyType(
    {
        "c": ExportFormat("a C header", ".h", _write_c, follows_turns=True),
        "csv": ExportFormat("CSV", ".csv", _write_csv, follows_turns=True),
        "matlab": ExportFormat("MATLAB", ".m", _write_matlab, follows_turns=True),
        "python": ExportFormat("Python", ".py", _write_python, follows_turns=True),
        "yaml": ExportFormat("YAML", ".yaml", _write_yaml),
    }
)


@cache
def load_formats() -> Mapping[str, ExportFormat]:
    """Load all formats by name, with those of add-ons, in alphabetical order."""
    added = {name: format_ for name, format_ in iterate_extensions(EXPORTS) if isinstance(format_, ExportFormat)}
    return MappingProxyType(dict(sorted({**added, **_FORMATS}.items())))


@dataclass(frozen=True)
class ExportOptions:
    """Options of an export.

    Args:
        to: The format.
        points: Number of positions in a table.
        draws: Number of draws beside the quantiles.
        at: Position of a format that holds at one; None for the middle of the range.
        device: A device.toml, of which YAML has the limits of compensation.
        force: Whether to replace an existing file.
    """

    to: str
    points: int
    draws: int
    at: tuple[float, str] | None
    device: Path | None
    force: bool


def export_fit(fit: Record, output: Path | None, options: ExportOptions) -> ExportedFile:
    """Write a fit in the format of another program.

    Args:
        fit: The fit.
        output: The file; named after the cable if None.
        options: Format and content.

    Raises:
        UsageError, DescriptionError: The format cannot express the cable, or the device does not state what is needed.
        StoreError: The file exists already, or cannot be written.
    """
    to, formats = options.to, load_formats()
    if to not in formats:
        raise UsageError(f"the add-on that writes {to} is not installed; install bowdenfit again.")
    path = Path(make_identifier(fit.name) + formats[to].ending) if output is None else output
    if path.exists() and not (options.force and path.is_file()):
        raise StoreError(f"{path} exists already; add --force to replace it, or name another file with --output.")
    fit.draws()
    refuse_inexpressible(fit, to, options.draws)
    compensation = None if options.device is None else _estimate_parameters(fit, to, options.device)
    trust = assess_for(fit, "coefficients")
    tables = tabulate_transmission(fit, options.points, options.draws, " and ".join(trust.troubles))
    point = convert_point(fit, tables.points, to, options.at)
    file = formats[to].write(ExportRequest(fit, tables, path, point, compensation))
    with file_to_write(path) as temporary:
        temporary.write_bytes(file.content)
    return ExportedFile(path, to, tuple(tables.sentences), trust.trusted, file.remarks)


def _estimate_parameters(fit: Record, to: str, device: Path) -> dict[str, Any]:
    refuse_compensation(to)
    estimate: Callable[[Record, Path], dict[str, Any]] | None = load_extension(CONTROLLERS, "compensation")
    if estimate is None:
        raise UsageError("the add-on that reads a device.toml is not installed; install bowdenfit again, or omit --device.")
    return estimate(fit, device)
