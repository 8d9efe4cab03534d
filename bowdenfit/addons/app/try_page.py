"""The page on which coefficients are tried by hand, and on which the likelihood of a fit is looked at."""

import asyncio
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

from nicegui import ui

from bowdenfit.addons.app.elements import VALUE_AT_FIRST, address, block, button, choice, field, markup, text
from bowdenfit.addons.app.equivalent_command import EquivalentCommand, write_command
from bowdenfit.addons.app.fit_job import FitRequest
from bowdenfit.addons.app.frame import attempt, frame, refused, section
from bowdenfit.addons.app.workbench import Workbench
from bowdenfit.errors import BowdenfitError, UsageError
from bowdenfit.pages.page import render_section
from bowdenfit.pages.section import Chart, Picture, prose_section
from bowdenfit.run.verb import VERB as FIT
from bowdenfit.words import significant

if TYPE_CHECKING:
    from bowdenfit.addons.app.trial import Slider, Trial, TrialModel
    from bowdenfit.finished_fit import Fit

_THROTTLE = 0.1  # s between two positions of a slider that is moved; a judgement


class TryPage:
    """The page of one data set, and of a fit of it.

    Args:
        workbench: Where they are.
        name: Name of the data set.
        fit_name: Name of the fit by which the sliders stand at first; empty for the medians of the priors.

    Raises:
        UsageError: There is no such data set or fit.
    """

    def __init__(self, workbench: Workbench, name: str, fit_name: str = "") -> None:
        self._workbench, self._name, self._fit_name = workbench, name, fit_name
        self._folder = workbench.data_set(name)
        if fit_name:
            workbench.results(fit_name)
        self._z: dict[str, float] = {}
        self._trial: Trial | None = None
        self._outputs: dict[str, tuple[Any, Slider]] = {}
        self._newest, self._busy = 0, False
        above = [(workbench.title_of(name), address("data", name))]
        above += [(fit_name, address("fit", fit_name))] if fit_name else []
        with frame("Try by hand", above):
            text("Move a coefficient: the model answers at once, next to what was measured. The fit is not changed.")
            self._place = block("div")
            with self._place:
                text("Reading the data set, and compiling its model ...", role="status")
        ui.timer(0.05, self._show, once=True)

    async def _show(self) -> None:
        """Show sliders, charts and the likelihood."""
        try:
            fit = await self._workbench.open_fit(self._fit_name) if self._fit_name else None
            make_model = import_module("bowdenfit.addons.app.trial").TrialModel  # which loads JAX
            self._model: TrialModel = await self._workbench.compute(make_model, self._folder, fit)
        except BowdenfitError as error:
            _refuse(self._place, error)
            return
        self._place.clear()
        with self._place:
            with block("div", "trying"):
                with block("div"), section("Values", "values"):
                    self._show_sliders()
                with block("div"), section("Against the data", "tried"):
                    self._misfit = block("p", "misfit", role="status", id="misfit")
                    self._charts = markup("", "div", id="trial-charts")
            self._show_fitting()
            if fit is not None:
                LikelihoodView(self._workbench, fit).show()
        await self._answer()

    def _show_sliders(self) -> None:
        """Show a slider for each parameter, the coefficients first."""
        first = [slider for slider in self._model.sliders if slider.is_coefficient] or list(self._model.sliders)
        further = [slider for slider in self._model.sliders if slider not in first]
        for slider in first:
            self._show_slider(slider)
        if further:
            with block("details"):
                text("Other parameters", "summary")
                for slider in further:
                    self._show_slider(slider)

    def _show_slider(self, slider: "Slider") -> None:
        """Show one slider with its value."""
        key, self._z[slider.name] = f"try-{slider.name}", slider.start
        with field(slider.name, key, slider.meaning), block("div", "dial"):
            knob = block("input", id=key, type="range", data_key=key, min=f"{slider.low:.12g}", max=f"{slider.high:.12g}")
            knob.props["step"] = f"{slider.step:.12g}"
            knob.props[VALUE_AT_FIRST] = f"{slider.start:.12g}"
            self._outputs[slider.name] = text("", "output", for_=key), slider

        async def turn(event: Any) -> None:
            self._z[slider.name] = float(event.args)
            await self._answer()

        knob.on("input", turn, throttle=_THROTTLE, js_handler="event => emit(event.target.value)")

    async def _answer(self) -> None:
        """Ask the model where the sliders stand; of positions that come meanwhile the last."""
        self._newest += 1
        if self._busy:
            return
        self._busy, answered = True, 0
        try:
            while answered != self._newest:
                answered = self._newest
                trial = await self._workbench.compute(self._model.ask, dict(self._z))
                self._trial = trial
                for name, (output, slider) in self._outputs.items():
                    unit = "" if slider.unit == "1" else f" {slider.unit}"
                    output.set_content(f"{significant(trial.values[name])}{unit}")
                self._misfit.clear()
                with self._misfit:
                    text(trial.misfit, "span")
                self._charts.set_content(_render_charts("trial", self._model.draw(trial)))
                self._show_commands()
                await asyncio.sleep(0)
        finally:
            self._busy = False

    def _show_fitting(self) -> None:
        """Show how the data set is fitted from the values that are tried, or with one of them held."""
        names = [slider.name for slider in self._model.sliders if slider.is_coefficient]
        if not names:
            return
        self._held = names[0]

        def hold(name: str) -> None:
            self._held = name
            self._show_commands()

        place = f"In {self._workbench.folder}:"
        with section("Fit from here", "start"):
            text("The search for the best fit begins at these values too, besides its own starts; the best of all is kept.")
            button("Start the fit from here", lambda: attempt(lambda: self._start(self._started)), "primary")
            self._start_command = EquivalentCommand([""], place, key="start-command")
        with section("Fit with a value held", "held"):
            text("One coefficient stays where you put it, and all others are fitted:")
            with block("div", "row"):
                with field("Coefficient that is held", "held-name"):
                    choice("held-name", self._held, [(name, name) for name in names], hold)
                button("Fit with it held", lambda: attempt(lambda: self._start(self._holding)))
            self._command = EquivalentCommand([""], place, key="held-command")

    def _start(self, request: FitRequest) -> None:
        """Start a fit.

        Raises:
            UsageError: The data set is being fitted already.
        """
        if running := self._workbench.running_fit(self._name):
            raise UsageError(f"the fit {running} of this data set runs already; wait for it, or cancel it.")
        self._workbench.start_fit(request)
        ui.navigate.to(address("fit", request.output.name))

    def _request(self, **changes: Any) -> FitRequest:
        return self._workbench.request_fit(self._workbench.free_name(self._name), self._name, **changes)

    @property
    def _started(self) -> FitRequest:
        """The fit from the values that are tried."""
        return self._request(start=self._model.list_start(self._tried))

    @property
    def _holding(self) -> FitRequest:
        """The fit with a coefficient held."""
        return self._request(settings=(self._model.hold(self._held, self._tried.values[self._held]),))

    @property
    def _tried(self) -> "Trial":
        """What the model says where the sliders stand.

        Raises:
            UsageError: It has not answered yet.
        """
        if self._trial is None:
            raise UsageError("the model is still being compiled; try again in a moment.")
        return self._trial

    def _show_commands(self) -> None:
        if hasattr(self, "_command"):
            for command, request in ((self._start_command, self._started), (self._command, self._holding)):
                command.show(write_command(FIT, vars(request), self._workbench.folder))


class LikelihoodView:
    """Profile of a parameter of a fit, and contours of two, worked out when they are asked for.

    Args:
        workbench: Which works them out.
        fit: The fit.
    """

    def __init__(self, workbench: Workbench, fit: "Fit") -> None:
        self._workbench, self._fit = workbench, fit
        self._likelihood = import_module("bowdenfit.addons.app.trial")  # which loads JAX
        self._names = [p.name for p in fit.model.space.free if p.role not in ("noise", "departure")]
        self._chosen = [*self._names[:2]]

    def show(self) -> None:
        """Show the menus and buttons, and what they bring below them."""
        if not self._names:
            return
        with section("Likelihood", "likelihood"):
            text("How fast the fit becomes worse when values move and all others are fitted again; the scatter is held.")
            with block("div", "row"):
                for number in range(len(self._chosen)):
                    with field(("Parameter", "Second parameter")[number], f"likelihood-{number}"):
                        self._show_choice(number)
                button("Draw the profile", self._show_profile)
                if len(self._chosen) > 1:
                    button("Draw contours of both", self._show_contour)
            self._place = block("div", role="status", id="likelihood-charts")

    def _show_choice(self, number: int) -> None:
        def choose(name: str) -> None:
            self._chosen[number] = name

        choice(f"likelihood-{number}", self._chosen[number], [(name, name) for name in self._names], choose)

    async def _show_profile(self) -> None:
        await self._draw(self._likelihood.draw_profile, self._chosen[0])

    async def _show_contour(self) -> None:
        await self._draw(self._likelihood.draw_contour, *self._chosen)

    async def _draw(self, draw: Any, *names: str) -> None:
        """Show what is drawn, or why it cannot be."""
        self._place.clear()
        with self._place:
            text("Fitting the other parameters again ...")
        try:
            sentences, chart = await self._workbench.compute(draw, self._fit, *names)
        except BowdenfitError as error:
            _refuse(self._place, error)
            return
        self._place.clear()
        with self._place:
            for sentence in sentences:
                text(sentence)
            markup(_render_charts("likelihood", [chart]), "div")


def _refuse(place: Any, error: BowdenfitError) -> None:
    """Show why there is no answer, in its place."""
    place.clear()
    with place:
        refused(str(error))


def _render_charts(name: str, charts: Sequence[Chart]) -> str:
    """Return charts as HTML, each a picture of its own."""
    pictures = tuple(
        Picture(f"{name}-{number}", chart.name, "", (chart,), f"{chart.y_label} by {chart.x_label}.", alone=True)
        for number, chart in enumerate(charts)
    )
    return render_section(prose_section("", (), pictures=pictures), {})
