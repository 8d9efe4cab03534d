"""The page of a data set: what was measured, how `check` understands it, and the button that fits it."""

from contextlib import suppress

from nicegui import ui

from bowdenfit.addons.app.add_rows import show_table_links
from bowdenfit.addons.app.description_edit import Part, exclude_part, include_part
from bowdenfit.addons.app.draft import list_refusals
from bowdenfit.addons.app.elements import address, block, button, field, link, text, text_input
from bowdenfit.addons.app.equivalent_command import EquivalentCommand, show_command, write_command
from bowdenfit.addons.app.fit_job import FitRequest
from bowdenfit.addons.app.frame import attempt, frame, refused, section
from bowdenfit.addons.app.history import show_history
from bowdenfit.addons.app.measured_view import MeasuredView, show_checked, sort_warnings
from bowdenfit.addons.app.workbench import Workbench
from bowdenfit.arguments import read_arguments
from bowdenfit.errors import BowdenfitError, UsageError
from bowdenfit.questions.check import check_data_set
from bowdenfit.questions.check.verb import VERB as CHECK
from bowdenfit.run.verb import VERB as FIT


def read_seed(typed: str) -> int | None:
    """Return a seed as `bowdenfit fit --seed` takes it; None, for one that is random, where nothing is typed.

    Args:
        typed: As it is typed.

    Raises:
        UsageError: It is not a whole number, is negative, or is too large.
    """
    seed: int | None = read_arguments(FIT.function, {"seed": typed.strip() or None}, typed=True)["seed"]
    return seed


class DataSetPage:
    """The page of a data set.

    Args:
        workbench: Where it lies.
        name: Name of the data set.

    Raises:
        UsageError: There is no such data set.
    """

    def __init__(self, workbench: Workbench, name: str) -> None:
        self._workbench, self._name, self._folder = workbench, name, workbench.data_set(name)
        self._fit_name, self._seed = workbench.free_name(name), ""
        with frame(workbench.title_of(name)):
            with section("Fit it", "fit"):
                with block("div", "row"):
                    if running := workbench.running_fit(name):
                        link(f"{running} is being fitted: see how far it is", address("fit", running), "button")
                    else:
                        button("Fit", lambda: attempt(self._start), "primary")
                with block("details"):
                    text("Name and seed", "summary")
                    with field("Kept as fits/", "fit-name"):
                        text_input("fit-name", self._fit_name, self._state_name)
                    self._seed_place = block("div")
                    self._show_seed()
                self._command = EquivalentCommand([""], f"In {workbench.folder}:", key="fit-command")
                self._show_command()
            with section("Change it", "add"), block("div", "row"):
                show_table_links(workbench, name)
                link("Describe the cable", address("describe", name), "button")
                link("Try by hand", address("try", name), "button")
                link("Live: fit again after each mounting", address("live", name), "button")
            with section("Fits of it", "history"):
                history = block("div")
            with section("What was measured", "understood"):
                show_command(CHECK, {"dataset": self._folder}, workbench.folder, key="check-command")
                self._place = block("div", aria_live="polite")
        with self._place:
            text("Reading ...")

        async def look_back() -> None:
            with history:
                await show_history(workbench, name)

        ui.timer(0.05, look_back, once=True)
        ui.timer(0.05, self._look, once=True)

    @property
    def _request(self) -> FitRequest:
        """What the button asks for.

        Raises:
            UsageError: The seed or the name cannot be taken.
        """
        return self._workbench.request_fit(self._fit_name, self._name, read_seed(self._seed))

    def _show_command(self) -> None:
        with suppress(UsageError):
            self._command.show(write_command(FIT, vars(self._request), self._workbench.folder))

    def _state_name(self, typed: str) -> None:
        self._fit_name = typed
        self._show_command()

    def _state_seed(self, typed: str) -> None:
        """Take a seed, or say beside it why it cannot be taken."""
        self._seed, fault = typed, ""
        try:
            read_seed(typed)
        except UsageError as error:
            fault = str(error)
        self._show_seed(fault)
        self._show_command()

    def _show_seed(self, fault: str = "") -> None:
        """Show the field of the seed, with why what is typed cannot be taken."""
        self._seed_place.clear()
        hint = "A whole number; if empty, chosen at random and recorded."
        with self._seed_place, field("Random seed", "seed", hint, fault):
            text_input("seed", self._seed, self._state_seed)

    def _start(self) -> None:
        """Start the fit.

        Raises:
            UsageError: The seed or the name cannot be taken, or the fit runs already.
        """
        if running := self._workbench.running_fit(self._name):
            raise UsageError(f"the fit {running} of this data set runs already; wait for it, or cancel it.")
        self._workbench.start_fit(self._request)
        ui.navigate.to(address("fit", self._fit_name))

    async def _look(self) -> None:
        """Show what `check` says, and what was measured."""
        folder, report, error = self._folder, None, None
        try:
            report = await self._workbench.compute(check_data_set, folder, {})
        except BowdenfitError as caught:
            error = caught
        self._place.clear()
        with self._place:
            warnings = sort_warnings(report) if report is not None else {}
            if report is not None:
                show_checked(report, warnings)
            elif error is not None:
                refused(str(error))
            refusals = list_refusals(error) if error else ()
            await MeasuredView(self._workbench, folder, self._change_part).show(refusals, warnings)

    async def _change_part(self, kind: str, file: str, part: Part, reason: str | None) -> None:
        """Leave a part of a table out with a reason, or take it in again without one; and look at the data set again.

        Raises:
            UsageError, DescriptionError, StoreError: cable.toml cannot be changed so.
        """
        if reason is None:
            await self._workbench.compute(include_part, self._folder, kind, file, part)
        else:
            await self._workbench.compute(exclude_part, self._folder, kind, file, part, reason)
        await self._look()
