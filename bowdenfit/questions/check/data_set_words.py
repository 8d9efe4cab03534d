"""A data set that was checked, in words: what was understood, row by row, and what the measurements cannot determine."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.description import ContactSettings, Description, FrictionSetting, QuantityValue
from bowdenfit.display import Block, Preformatted, Title, blocks_of, render_text, separate
from bowdenfit.files.cells import AS_DECIMALS
from bowdenfit.files.row_account import RowAccount
from bowdenfit.frames import Frame
from bowdenfit.kinds import iterate_tables
from bowdenfit.kinds.descriptions import order_groups
from bowdenfit.kinds.kind import FrictionKind
from bowdenfit.kinds.measured_columns import describe_cut_off
from bowdenfit.kinds.tables import Measurements, StretchTable
from bowdenfit.questions import check as room
from bowdenfit.reading import Reading, read
from bowdenfit.recordings.recording import Recordings
from bowdenfit.words import counted, filled, kept_narrow, listed


@dataclass(frozen=True, repr=False)
class Report(Dataset):
    """A data set that shows itself as `bowdenfit check` does; it can be fitted as it is."""

    @property
    def warnings(self) -> list[str]:
        """Warnings about what the measurements cannot determine, as far as counting shows."""
        return collect_warnings(self)


def check_data_set(dataset: str | Path | Dataset | Frame, reading: Reading) -> Report:
    """Read a data set, and build the model where only that can tell whether the description makes sense.

    Loading JAX takes longer than everything else here, so the model is built only for names and priors that the
    description alone cannot judge.

    Args:
        dataset: Folder, file, or data set.
        reading: Keywords of `bowdenfit.read`.

    Raises:
        DescriptionError, DatasetError: The fault, in a sentence.
    """
    data = read(dataset, **reading)
    description = data.description
    if (
        description.friction_model != "capstan"
        or data.measurements.table(Recordings) is not None
        or description.prior
        or any(setting.prior for setting in description.friction.values())
        or any(not name.startswith("mu") for name in description.coefficients)  # another parameter may be called that
    ):
        room.check_priors(data)
    return Report(**vars(data))


def describe_data_set(dataset: Dataset) -> str:
    """Describe what was understood of a data set, as text."""
    return render_text(data_set_blocks(dataset))


@blocks_of.register(Report)
def data_set_blocks(dataset: Dataset) -> list[Block]:
    """Return what was understood of a data set."""
    description, measurements = dataset.description, dataset.measurements
    warnings = collect_warnings(dataset)
    state = f"{counted(len(warnings), 'warning')}, at the end." if warnings else "Nothing is wrong."
    contacts = [
        f"{c.name}: {c.friction}, {f'{c.special_law} law, ' if c.special_law else ''}{_describe_angle_source(c, description)}"
        for c in description.contact
    ]
    settings = [
        f"{name}: {_describe_setting(description.friction.get(name))}{_groups_note(dataset, name)}"
        for name in description.coefficients
    ]
    described = [(kind.heading, list(kind.describe(table, description))) for kind, table in iterate_tables(measurements)]
    lines = [line for heading, table_lines in described if not heading for line in table_lines]
    lines += [f"note: {description.cable.sharp_bend}"] if description.cable.sharp_bend else []
    sections = [("Measurements", lines), *((heading, table_lines) for heading, table_lines in described if heading)]
    sections[-1][1].extend(f"note: {remark}" for remark in measurements.remarks if remark not in warnings)
    rows = (line for words in describe_rows(dataset) for line in words.splitlines())
    return separate(
        [Title(description.name), f"Everything could be read. {state}"],
        [_describe_route(description)],
        _list_lines("Contacts", contacts),
        _list_lines("Friction coefficients", settings),
        *([_list_lines("Motor, read in place of a load cell", motor)] if (motor := _describe_motor(description)) else []),
        *(_list_lines(heading, section_lines) for heading, section_lines in sections),
        ["Rows of the files:", Preformatted("\n".join(f"  {line}" for line in rows))],
        [f"Warning: {warning}" for warning in warnings],
    )


def _describe_route(description: Description) -> str:
    """Describe the route, or that there is none."""
    route = description.route
    if route is None:
        return "Route: none, so there is no length to choose."
    choices = f"; {counted(len(route.choices), 'length')} can be bought" if route.choices else ""
    return f"Route: {route.variable}, {route.range[0]:g} to {route.range[1]:g} {route.unit}{choices}."


def _describe_motor(description: Description) -> list[str]:
    """Return what is stated of a motor, and what is learned, line by line; nothing without one."""
    motor = description.motor
    if motor is None:
        return []
    gear = [("gear efficiency", motor.gear_efficiency), ("gear friction", motor.gear_friction)]
    factors = [("torque constant", motor.torque_constant), ("gear ratio", motor.gear_ratio)]
    lines = [f"{name}: {_describe_quantity(quantity)}" for name, quantity in factors if quantity is not None]
    learned = "learned from the readings"
    return lines + [f"{name}: {learned if quantity is None else _describe_quantity(quantity)}" for name, quantity in gear]


def _describe_quantity(quantity: QuantityValue) -> str:
    """Return a quantity with its standard deviation and unit."""
    sd = "" if quantity.sd is None else f" ± {quantity.sd:g}"
    return f"{quantity.value:g}{sd}{'' if quantity.unit == '1' else f' {quantity.unit}'}"


def _list_lines(heading: str, lines: Iterable[str]) -> list[Block]:
    """Return indented lines under a heading."""
    return [f"{heading}:", Preformatted("\n".join(kept_narrow(line, "  ") for line in lines))]


def _groups_note(dataset: Dataset, coefficient: str) -> str:
    """Name the groups that have a coefficient each; empty where all readings share it."""
    contacts = [c for c in dataset.description.contact if c.friction == coefficient]
    if not (dataset.description.by_group and contacts[0].by_group):
        return ""
    return f"; one for each of the groups {listed(order_groups(dataset.description, dataset.measurements))}"


def collect_warnings(dataset: Dataset) -> list[str]:
    """Return warnings about what the measurements cannot determine, as far as counting shows."""
    description, measurements = dataset.description, dataset.measurements
    warnings = list(describe_unusable_readings(dataset))
    free = [
        n
        for n in description.coefficients
        if not (n in description.friction and description.friction[n].fixed is not None)
    ]
    conditions = _count_conditions(measurements)
    shared = description.stretch.friction is not None and measurements.table(StretchTable) is not None
    if not conditions and not shared:
        warnings.append(
            "no table has forces, efficiencies, a loop or recordings, so the friction coefficients rest on their priors alone."
        )
    elif 0 < conditions < len(free):
        warnings.append(
            f"{len(free)} friction coefficients are to be determined from {conditions} "
            f"{'different conditions' if conditions > 1 else 'condition'}; what these do not determine will rest on the priors."
        )
    for kind, table in iterate_tables(measurements):
        warnings += kind.warnings(table, description, measurements)
    if "wrap_angle" in description.preload.model_fields_set and not description.preload_follows_stretch:
        warnings.append(
            "cable.toml gives the wrap angle at which the preload holds, but takes the preload as constant; write "
            'model = "stretch" under [preload] if it changes with the wrap angle.'
        )
    return warnings


def describe_unusable_readings(dataset: Dataset) -> tuple[str, ...]:
    """Describe copied or cut-off readings, wrong wrap angles and faults of the bench; fits of such readings are not trusted."""
    return (
        describe_copied_readings(dataset)
        + describe_cut_off_readings(dataset)
        + describe_wrong_angles(dataset)
        + describe_bench_faults(dataset)
    )


def describe_copied_readings(dataset: Dataset) -> tuple[str, ...]:
    """Describe readings that were pasted twice or saved as another run, with a remedy; equal readings may be chance."""
    copies = [sentence for kind, table in iterate_tables(dataset.measurements) for sentence in kind.copied_readings(table)]
    return tuple(
        f"{sentence[0].upper()}{sentence[1:]}. Measurements do not repeat themselves so exactly; the usual cause is a table "
        "that was pasted or exported twice, or a run that was copied and not measured. Copies count as measurements, so that "
        "intervals are too narrow: leave them out, or put in what was measured."
        for sentence in copies
    )


def describe_assumed_decimals(dataset: Dataset) -> list[str]:
    """Return what was assumed of columns whose numbers could be thousands, which the page of a fit must state."""
    return [remark for remark in dataset.measurements.remarks if AS_DECIMALS in remark]


def describe_bench_faults(dataset: Dataset) -> tuple[str, ...]:
    """Describe faults of the bench that the readings of a table show by themselves; see `Kind.bench_faults`."""
    tables = iterate_tables(dataset.measurements)
    return tuple(sentence for kind, table in tables for sentence in kind.bench_faults(table, dataset.description))


def describe_wrong_angles(dataset: Dataset) -> tuple[str, ...]:
    """Describe wrap angles that must be wrong, table by table; see `Kind.misread_angles`."""
    sentences = (kind.misread_angles(table, dataset.description) for kind, table in iterate_tables(dataset.measurements))
    return tuple(sentence for sentence in sentences if sentence)


def describe_cut_off_readings(dataset: Dataset) -> tuple[str, ...]:
    """Describe readings that are equal because a range ended there, with a remedy; recordings leave such samples out."""
    cut_off = [
        sentence
        for kind, table in iterate_tables(dataset.measurements)
        for column in kind.measured_columns(table)
        if (sentence := describe_cut_off(column, table.origin))
    ]
    return tuple(
        f"{sentence}. The usual cause is the end of an instrument's range, or a limit in a spreadsheet, at which readings were "
        "cut off; taken as they are, they bias the fit. Leave these readings out, or repeat them with an "
        "instrument that reaches further; if they really are equal, record one more digit."
        for sentence in cut_off
    )


def _count_conditions(measurements: Measurements) -> int:
    """Count the different wrap-angle conditions under which force was measured."""
    rows = []
    for kind, table in iterate_tables(measurements):
        if isinstance(kind, FrictionKind):
            conditions = kind.conditions(table)
            rows += [
                tuple(np.nan_to_num(row, nan=-1.0)) for row in np.column_stack([conditions.route, conditions.own.angle])
            ]
    return len(set(rows))


def _describe_angle_source(contact: ContactSettings, description: Description) -> str:
    """Describe what gives the wrap angle of a contact."""
    source = contact.wrap_angle
    if source.constant is not None:
        sd = f" ± {source.sd:g}" if source.sd else ""
        return f"constant wrap angle {source.value:g}{sd} {source.unit}"
    if source.curve:
        place = (
            f", published range {source.published_range[0]:g} to {source.published_range[1]:g}"
            if source.published_range
            else ""
        )
        return f"{source.curve} curve through the column {source.column!r}{place} ({description.geometry} geometry)"
    nominal = f"{source.nominal.value:g} {source.nominal.unit}" if source.nominal else "the rows' mean"
    return f"wrap angle measured in every row, column {source.column!r}; predictions use {nominal}"


def _describe_setting(setting: FrictionSetting | None) -> str:
    """Describe what the description says of a friction coefficient."""
    if setting is None:
        return "free, default prior"
    if setting.fixed is not None:
        return f"fixed at {setting.fixed:g}"
    if setting.measured is not None:
        return f"measured separately, {setting.measured.value:g} ± {setting.measured.sd:g}"
    return f"free, prior {setting.prior.model_dump(exclude_none=True)}" if setting.prior else "free"


def describe_rows(dataset: Dataset) -> list[str]:
    """Describe which rows of every file of a data set were read."""
    accounts = [line for account in dataset.accounts for line in describe_row_account(account, account.file)]
    return [*describe_first_and_last_rows(dataset), *accounts]


def describe_row_account(account: RowAccount, file: str = "") -> list[str]:
    """Describe how many rows were read, and every row that was not, with the reason.

    Args:
        account: Row account of a file.
        file: Its name, where there are several.
    """
    over = f", headings in row{'s' if len(account.headings) > 1 else ''} {', '.join(map(str, account.headings))}"
    before = f"{file}: of" if file else "Of"
    held = "holds a reading" if account.read == 1 else "hold readings"
    lines = [f"{before} {counted(account.rows, 'row')} {account.read} {held}{over if account.headings else ''}."]
    unused = [row.words for row in account.left_out] + [account.beside_in_words] * bool(account.beside)
    lines += [f"{account.note[:1].upper()}{account.note[1:]}."] * bool(account.note)
    return [*map(kept_narrow, lines), *(filled(f"Not used: {words}.", "  " if file else "") for words in unused)]


def describe_first_and_last_rows(data: Dataset) -> list[str]:
    """Describe the first and the last row of each table as understood."""
    lines = []
    for kind, table in iterate_tables(data.measurements):
        page = kind.file_rows(table, data.description)
        if page is None:
            continue
        heads, rows = page
        for which, i in (("First", 0), ("Last", -1)):
            cells = ", ".join(f"{head} {cell}" for head, cell in zip(heads, rows[i], strict=True) if cell)
            lines.append(filled(f"{which} row, {table.origin.describe_row(i)}: {cells}."))
    return lines
