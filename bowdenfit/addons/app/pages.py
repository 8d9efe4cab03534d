"""The addresses of the app: its pages, and the files that they show or take."""

from collections.abc import Callable
from pathlib import Path

from fastapi import FastAPI, Request, Response
from fastapi.responses import FileResponse, PlainTextResponse
from nicegui import ui

from bowdenfit.addons.app.add_rows import AddRowsPage
from bowdenfit.addons.app.ask import export_file
from bowdenfit.addons.app.bring import show_draft
from bowdenfit.addons.app.data_set import DataSetPage
from bowdenfit.addons.app.describe import DescribePage
from bowdenfit.addons.app.frame import frame, refused, style_and_script
from bowdenfit.addons.app.live import LivePage
from bowdenfit.addons.app.see import FitPage
from bowdenfit.addons.app.side_by_side import TwoFitsPage
from bowdenfit.addons.app.start_page import show_start
from bowdenfit.addons.app.try_page import TryPage
from bowdenfit.addons.app.workbench import Workbench
from bowdenfit.errors import BowdenfitError
from bowdenfit.pages.page import page_policy
from bowdenfit.results.folder import DETAILS_TEXT, POSTERIOR, REPORT, SUMMARY, SUMMARY_TEXT, kept_file

_REFUSED, _MISSING = 422, 404
_KEPT = {
    REPORT: "text/html", SUMMARY: "application/json", SUMMARY_TEXT: "text/plain; charset=utf-8",
    DETAILS_TEXT: "text/plain; charset=utf-8", POSTERIOR: "application/x-netcdf",
}  # fmt: skip


def register_pages(workbench: Workbench, application: FastAPI) -> None:
    """Make the pages known.

    Args:
        workbench: What they show.
        application: Which answers.
    """
    _register_files(workbench, application)

    @ui.page("/")
    def start() -> None:
        show_start(workbench)

    @ui.page("/new/{key}")
    async def draft(key: str) -> None:
        if key in workbench.drafts:
            await show_draft(workbench, workbench.drafts[key])
        else:
            _show_refusal("New data set", "These files are gone because the app was restarted; add them again.")

    @ui.page("/data/{name}")
    def data_set(name: str) -> None:
        _show_unless_refused(name, lambda: DataSetPage(workbench, name))

    @ui.page("/describe/{name}")
    def describe(name: str) -> None:
        _show_unless_refused(f"Describe {name}", lambda: DescribePage(workbench, name))

    @ui.page("/table/{name}")
    def table(name: str, file: str = "") -> None:
        _show_unless_refused(f"Add rows to {file}", lambda: AddRowsPage(workbench, name, file))

    @ui.page("/fit/{name}")
    def fit(name: str) -> None:
        _show_unless_refused(name, lambda: FitPage(workbench, name))

    @ui.page("/live/{name}")
    def live(name: str) -> None:
        _show_unless_refused(name, lambda: LivePage(workbench, name))

    @ui.page("/try/{name}")
    def try_by_hand(name: str, fit: str = "") -> None:
        _show_unless_refused("Try by hand", lambda: TryPage(workbench, name, fit))

    @ui.page("/compare")
    def compare(one: str = "", other: str = "") -> None:
        TwoFitsPage(workbench, (one, other))


def _show_unless_refused(title: str, show: Callable[[], object]) -> None:
    """Show a page, or why it cannot be shown."""
    try:
        show()
    except BowdenfitError as error:
        _show_refusal(title, str(error))


def _show_refusal(title: str, sentence: str) -> None:
    with frame(title):
        refused(sentence)


def _register_files(workbench: Workbench, application: FastAPI) -> None:
    """Make the addresses of files known."""
    style, script = style_and_script()

    @application.get("/assets/app.css")
    def get_style() -> Response:
        return Response(style, media_type="text/css")

    @application.get("/assets/app.js")
    def get_script() -> Response:
        return Response(script, media_type="text/javascript")

    @application.put("/upload/{key}")
    async def take_file(key: str, name: str, request: Request) -> Response:
        try:
            draft = workbench.drafts[key]
            draft.is_arriving = True
            await _write_upload(draft.new_file(name), request)
        except KeyError:
            return PlainTextResponse("The app was restarted since this page was opened; load it again.", _MISSING)
        except BowdenfitError as error:
            return PlainTextResponse(str(error), _REFUSED)
        return PlainTextResponse("taken")

    @application.get("/kept/{fit}/{name}")
    async def get_kept(fit: str, name: str) -> Response:
        try:
            if name in _KEPT:
                return _kept(kept_file(workbench.results(fit), name))
            return Response(await workbench.draw_figure(fit, name.removesuffix(".png")), media_type="image/png")
        except BowdenfitError as error:
            return PlainTextResponse(str(error), _MISSING)

    @application.get("/export/{fit}/{target}")
    async def get_export(fit: str, target: str) -> Response:
        try:
            name, content = await workbench.compute(export_file, await workbench.open_fit(fit), target)
        except BowdenfitError as error:
            return PlainTextResponse(str(error), _REFUSED)
        return Response(content, media_type="application/octet-stream", headers=_as_attachment(name))


def _as_attachment(name: str) -> dict[str, str]:
    return {"content-disposition": f"attachment; filename={name}"}


async def _write_upload(path: Path, request: Request) -> None:
    """Write a file that comes up, whole or not at all."""
    whole = False
    try:
        with path.open("wb") as file:
            async for piece in request.stream():
                file.write(piece)
        whole = True
    finally:
        if not whole:
            path.unlink(missing_ok=True)


def _kept(path: Path) -> Response:
    """Return a file of a results folder, which may come from elsewhere: it runs our scripts alone, and reaches nothing."""
    if not path.is_file():
        return PlainTextResponse(f"This fit has no {path.name}; it was removed, or could not be written.", _MISSING)
    headers = {"content-security-policy": f"{page_policy()}; sandbox allow-scripts"}
    return FileResponse(path, media_type=_KEPT[path.name], headers=headers)
