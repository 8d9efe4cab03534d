"""The page on which a cable is described: a form for every key of its cable.toml, with the text next to it."""

import tomllib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from html import escape
from itertools import groupby
from pathlib import Path
from typing import Any

from nicegui import ui

from bowdenfit.addons.app.curve_menu import is_of_curves, show_curve_menu
from bowdenfit.addons.app.description_edit import read_description_text, write_description
from bowdenfit.addons.app.description_form import (
    FormField,
    FormGroup,
    add_part,
    list_groups,
    set_field,
    table_kinds,
)
from bowdenfit.addons.app.description_values import MENU, YES_NO
from bowdenfit.addons.app.elements import address, block, button, choice, field, markup, text, text_input
from bowdenfit.addons.app.frame import attempt, frame, refused, section
from bowdenfit.addons.app.page_words import page_words
from bowdenfit.addons.app.workbench import Workbench
from bowdenfit.dataset import read_dataset
from bowdenfit.errors import BowdenfitError, UsageError
from bowdenfit.kinds.descriptions import parse_description

_VALUE = "event => emit(event.target.value)"
_PAUSE = 0.6  # s between two checks of a text that is typed; a judgement
_ADD = "add-"  # begins the keys of fields that add a part
_PARTS = (("contact", "Contact"), ("friction", "Friction coefficient"), ("prior", "Prior of another parameter"))


@dataclass(frozen=True)
class RefusedEntry:
    """What is typed into a field and cannot be taken; the description keeps what it has.

    Args:
        typed: As it is typed.
        fault: Why it cannot be taken.
        kept: What the description has in its place.
    """

    typed: str
    fault: str
    kept: str = ""


class DescribePage:
    """The page of one cable.toml.

    Args:
        workbench: Where the data set lies.
        name: Name of the data set.

    Raises:
        UsageError: There is no such data set, or its description is no text.
    """

    def __init__(self, workbench: Workbench, name: str) -> None:
        self._workbench, self._name = workbench, name
        self._text = self._saved = read_description_text(workbench.data_set(name))
        self._open: set[str] = set()
        self._faults: tuple[BowdenfitError, ...] = ()
        self._messages: dict[str, str] = {}
        self._data_error: BowdenfitError | None = None
        self._read_text = ""
        self._refused: dict[str, RefusedEntry] = {}
        title = workbench.title_of(name)
        with frame("Describe the cable", ((title, address("data", name)),)):
            text("Every key that cable.toml may have. What is left empty is left out, and then holds what is said below it.")
            self._status = block("div", role="status", id="description-status")
            with block("div", "describing"):
                self._form = block("fieldset", "whole-form", id="description-form", aria_label="Keys")
                with block("div", "beside"), section("cable.toml", "description-text"):
                    self._editor = block("div")
            self._draw()
        ui.timer(0.05, self._read_data, once=True)

    def _draw(self) -> None:
        """Show form and text."""
        self._draw_form()
        self._editor.clear()
        with self._editor:
            area = markup(escape(self._text), "textarea", "toml", id="toml", data_key="toml", rows="32", aria_label="Text")
            area.props["spellcheck"] = "false"
            area.on("input", self._check_typed, throttle=_PAUSE, leading_events=False, js_handler=_VALUE)
            area.on("change", self._take_text, js_handler=_VALUE)
            with block("div", "row"):
                button("Save cable.toml", lambda: attempt(self._save), "primary")
                button("Undo all changes", self._undo)
        self._show_status()

    async def _read_data(self) -> None:
        """Read the measured files as a description says that is not wrong by itself, and show what is wrong then."""
        text_read = self._read_text = self._text
        if find_faults(text_read):
            return
        folder = self._workbench.data_set(self._name)
        error = await self._workbench.compute(find_data_error, text_read, folder)
        if text_read == self._text == self._read_text:
            is_same = str(error) == str(self._data_error)
            self._data_error = error
            if not is_same:
                self._draw_form()
                self._show_status()

    def _draw_form(self) -> None:
        """Show the groups of the form; of a text that is no TOML as they were, to be used again when it is."""
        try:
            groups = list_groups(tomllib.loads(self._text))
        except (tomllib.TOMLDecodeError, RecursionError):
            self._form.props["disabled"] = True
            return
        self._form.props.pop("disabled", None)
        self._form.clear()
        self._faults, data_error = find_faults(self._text), self._data_error
        if not self._faults and data_error is not None:
            self._faults = data_error.faults or (data_error,)
        with self._form:
            self._messages = _place_faults(self._faults, groups)
            values = {entry.key: entry.value for group in groups for entry in group.fields}
            refused_entries = self._refused.items()  # but those that were changed in the text since
            self._refused = {key: entry for key, entry in refused_entries if values.get(key, "") == entry.kept}
            for number, group in enumerate(groups):
                self._show_group(group, number == 0)
            self._show_additions()

    def _show_group(self, group: FormGroup, is_first: bool) -> None:
        """Show one group, open where it was opened."""
        own_faults = [fault for fault in self._faults if fault.key_path and fault.key_path == group.path]
        faults = [str(fault) for fault in own_faults if not fault.row]
        with self._details(group.title, group.is_stated, is_first or bool(faults), group.fields):
            for sentence in faults:
                text(page_words(sentence), "p", "fault")
            for (name, hint), fields in groupby(group.fields, lambda entry: (entry.part, entry.part_hint)):
                entries = list(fields)
                if not name:
                    self._show_fields(entries)
                    continue
                with self._details(f"{group.title}, {name}", any(entry.value for entry in entries), False, entries, name):
                    self._show_entries(hint, entries)

    def _show_entries(self, hint: str, fields: Sequence[FormField]) -> None:
        """Show a table of names or a list: what it does and what each key of an entry does once, then each entry in a row."""
        keys = {entry.label: entry.hint for entry in fields if entry.entry}
        for line in (hint, *(f"{label}: {words}" for label, words in keys.items() if words)):
            text(page_words(line), classes="hint")
        for name, of_entry in groupby(fields, lambda entry: entry.entry):
            if not name:
                self._show_fields(list(of_entry))
                continue
            with block("fieldset", "entry"):
                text(name, "legend", dir="auto")
                self._show_fields([replace(entry, hint="") for entry in of_entry])

    @contextmanager
    def _details(
        self, key: str, is_stated: bool, is_open: bool, entries: Sequence[FormField], title: str = ""
    ) -> Iterator[None]:
        """Put fields below a heading that opens them; it is open where one of them is refused, or it was opened."""
        with block("details") as part:
            title = title or key
            text(title if is_stated else f"{title} (nothing stated)", "summary", dir="auto")
            yield
        if is_open or key in self._open or any(self._find_fault(entry) for entry in entries):
            part.props["open"] = True
        part.on("toggle", partial(self._note_open, key), js_handler="event => emit(event.target.open)")

    def _show_fields(self, entries: Sequence[FormField]) -> None:
        for entry in entries:
            self._show_field(entry)

    def _note_open(self, title: str, event: Any) -> None:
        (self._open.add if event.args else self._open.discard)(title)

    def _show_field(self, entry: FormField) -> None:
        """Show one key."""
        label, fault = f"{entry.label} (needed)" if entry.needed else entry.label, self._find_fault(entry)
        if refusal := self._refused.get(entry.key):
            entry = replace(entry, value=refusal.typed)
        with field(label, entry.key, entry.hint, fault):
            options = entry.options if entry.kind == MENU else ("true", "false") if entry.kind == YES_NO else ()
            if options:
                unknown = () if entry.value in ("", *options) else (entry.value,)
                choices = [("", "left out"), *((option, option) for option in (*options, *unknown))]
                if is_of_curves(options):
                    show_curve_menu(self._workbench, entry.key, entry.value, choices, self._setter(entry), label)
                else:
                    choice(entry.key, entry.value, choices, self._setter(entry))
            else:
                text_input(entry.key, entry.value, self._setter(entry), entry.example)

    def _find_fault(self, entry: FormField) -> str:
        """Return why a key is refused as it is, or as it is typed; empty where it is not."""
        if refusal := self._refused.get(entry.key):
            return refusal.fault
        return self._messages.get(entry.key, "")

    def _setter(self, entry: FormField) -> Callable[[str], Any]:
        async def change(typed: str) -> None:
            await self._take(entry.key, typed, lambda: set_field(self._text, entry, typed), entry.value)

        return change

    async def _take(self, key: str, typed: str, change: Callable[[], str], kept: str = "") -> None:
        """Take what is typed into a field, or keep it there with why it cannot be taken."""
        self._refused.pop(key, None)
        try:
            self._text = change()
        except BowdenfitError as error:
            self._refused[key] = RefusedEntry(typed, str(error), kept)
        self._draw()
        await self._read_data()

    def _show_additions(self) -> None:
        """Show how a contact, a coefficient, a prior or a table is added."""
        with block("details") as part:
            text("Add a contact, a coefficient, a prior or a table", "summary")
            for topic, words in _PARTS:
                self._show_addition(topic, words)
            key = f"{_ADD}tables"
            refusal = self._refused.get(key, RefusedEntry("", ""))
            kind = {"name": refusal.typed}
            with block("div", "row"):
                with field("Table of", key, fault=refusal.fault):
                    options = [("", "choose one"), *((name, name) for name in table_kinds())]
                    choice(key, refusal.typed, options, lambda name: kind.update(name=name))
                button("Add the table", lambda: self._add("tables", kind["name"]), key="add-table")
        if any(key.startswith(_ADD) for key in self._refused):
            part.props["open"] = True

    def _show_addition(self, topic: str, words: str) -> None:
        """Show the field and the button that add one."""
        key = f"{_ADD}{topic}"
        refusal = self._refused.get(key, RefusedEntry("", ""))
        name = {"name": refusal.typed}
        with block("div", "row"):
            with field(f"{words}: its name", key, fault=refusal.fault):
                text_input(key, refusal.typed, lambda typed: name.update(name=typed))
            button(f"Add the {words.split()[0].lower()}", lambda: self._add(topic, name["name"]), key=f"{key}-button")

    async def _add(self, topic: str, name: str) -> None:
        await self._take(f"{_ADD}{topic}", name, lambda: add_part(self._text, topic, name))

    def _check_typed(self, event: Any) -> None:
        """Say what is wrong with a text while it is typed."""
        self._text = str(event.args)
        self._show_status()

    async def _take_text(self, event: Any) -> None:
        """Take a text that was typed, into the form too."""
        self._text = str(event.args)
        self._draw_form()
        self._show_status()
        await self._read_data()

    def _show_status(self) -> None:
        """Show whether the description can be read."""
        self._status.clear()
        with self._status:
            if faults := [*map(str, find_faults(self._text)), *self._list_refused()]:
                refused("\n".join(faults))
                return
            state = "It is as it was saved." if self._text == self._saved else "It can be saved."
            text(f"Nothing is wrong with this description by itself. {state}", classes="state good")
            if self._data_error is not None and self._read_text == self._text:
                refused(f"The measured files cannot be read as it says.\n{self._data_error}")

    def _list_refused(self) -> list[str]:
        """Return why fields of keys cannot be taken; names of parts that are not added yet are none."""
        return [entry.fault for key, entry in self._refused.items() if not key.startswith(_ADD)]

    async def _undo(self) -> None:
        self._text, self._refused = self._saved, {}
        self._draw()
        await self._read_data()

    def _save(self) -> None:
        """Save it, unless it was changed elsewhere meanwhile.

        Raises:
            UsageError, DescriptionError, StoreError: It cannot be saved.
        """
        if self._list_refused():
            raise UsageError("a field holds what cannot be taken; see there, and correct or clear it. Nothing was saved.")
        folder = self._workbench.data_set(self._name)
        if read_description_text(folder) != self._saved:
            raise UsageError(
                "cable.toml has changed since this page was opened, and nothing was saved; copy your text, load this page "
                "again, and put your changes in."
            )
        write_description(folder, self._text)
        ui.navigate.to(address("data", self._name))


def _place_faults(faults: Sequence[BowdenfitError], groups: Sequence[FormGroup]) -> dict[str, str]:
    """Return why fields are refused, by their keys: of each fault the first whose keys lead to its own, or are below them."""
    messages: dict[str, str] = {}
    for fault in faults:
        keys = fault.key_path
        inside = [entry for group in groups if len(keys) > len(group.path) for entry in group.fields]
        fields = (entry for entry in inside if all(a == b for a, b in zip(entry.path, keys, strict=False)))
        if (entry := next(fields, None)) is not None:
            messages.setdefault(entry.key, str(fault))
    return messages


def find_faults(description: str) -> tuple[BowdenfitError, ...]:
    """Return why the text of a description is refused by itself."""
    try:
        parse_description(tomllib.loads(description))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        cause = "The usual cause is a missing quotation mark or bracket there; the form can be used again when it is corrected."
        return (UsageError(f"This is no TOML: {error}. {cause}"),)
    except BowdenfitError as error:
        return error.faults or (error,)
    return ()


def find_data_error(description: str, folder: Path) -> BowdenfitError | None:
    """Return why the measured files of a data set cannot be read as the text of a description says; None where they can.

    Args:
        description: The text, which is not wrong by itself.
        folder: The data set.
    """
    try:
        read_dataset(parse_description(tomllib.loads(description)), folder, {})
    except BowdenfitError as error:
        return error
    return None
