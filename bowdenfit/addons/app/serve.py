"""Serve the app to this machine until it is stopped."""

import asyncio
import logging
import socket
import threading
import webbrowser
from collections.abc import Callable
from pathlib import Path

import uvicorn
from fastapi import FastAPI
from nicegui import app as nicegui_app
from nicegui import ui

from bowdenfit.addons.app.guard import HOST, Guard, entry_page
from bowdenfit.addons.app.pages import register_pages
from bowdenfit.addons.app.scratch import scratch_folder
from bowdenfit.addons.app.workbench import Workbench
from bowdenfit.errors import UsageError

_LOOK = 0.2  # s between two looks at whether to stop; a judgement


def serve_app(
    folder: Path,
    port: int,
    browser: bool,
    is_stopped: Callable[[], bool],
    say: Callable[[str], None],
    on_error: Callable[[Exception], None],
) -> None:
    """Serve the app until it is stopped; fits that run then end, and keep what is sampled.

    Args:
        folder: Folder of the data sets and fits.
        port: Port to listen on; 0 for one that is free.
        browser: Whether to open the page in the default browser.
        is_stopped: Whether the program is to stop.
        say: Prints the address.
        on_error: Called with what goes wrong in a page.

    Raises:
        UsageError: There is no such folder, or the port is in use.
    """
    if not folder.is_dir():
        raise UsageError(f"{folder} is not a folder; name the one in which data sets and fits are, or leave it out.")
    with _listen(port) as listening, scratch_folder() as scratch:
        workbench = Workbench(folder, scratch)
        application = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
        register_pages(workbench, application)
        nicegui_app.config.quasar_config["loadingBar"]["skipHijack"] = True  # a bar that nothing tells screen readers about
        ui.run_with(
            application, title="bowdenfit", dark=None, language="en-US", tailwind=False, show_welcome_message=False,
            reconnect_timeout=60.0,  # s; JAX loads slowly on a busy machine
        )  # fmt: skip
        printed = {""}

        def print_address(used: str = "", words: str = "To open the app in another browser:") -> None:
            if used in printed:
                printed.add(key := guard.new_key())
                say(f"{words} {guard.address(key)}")

        guard = Guard(application, listening.getsockname()[1], print_address, on_error)
        nicegui_app.on_exception(on_error)
        print_address(words="The app is open at")
        say("This address opens it once. Ctrl-C ends the app.")
        if browser:
            open_browser(guard.address(guard.new_key()), scratch)
        try:
            asyncio.run(_serve(guard, listening, is_stopped))
        finally:
            workbench.close()


def open_browser(address: str, scratch: Path) -> None:
    """Open an address in the default browser by a file that only this user can read.

    The command line of a browser can be read by every user of this machine, and the address has a key.

    Args:
        address: The address.
        scratch: Folder that only this user can read.
    """
    page = scratch / "open.html"
    page.touch(0o600, exist_ok=False)
    page.write_text(entry_page(address), encoding="utf-8")
    threading.Thread(target=webbrowser.open, args=(page.as_uri(),), daemon=True).start()  # some browsers do not return


def _listen(port: int) -> socket.socket:
    """Return a socket of this machine that listens on a port."""
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((HOST, port))
        listening.listen()  # whoever asks before the server is ready waits
    except (OSError, OverflowError):
        listening.close()
        raise UsageError(f"--port {port} is in use or not allowed here; name another, or leave it out.") from None
    return listening


async def _serve(guarded: Guard, listening: socket.socket, is_stopped: Callable[[], bool]) -> None:
    """Serve until it is stopped; libraries do not print, because each browser that waits no longer is an error to them."""
    logging.getLogger("nicegui").setLevel(logging.CRITICAL)
    config = uvicorn.Config(guarded, log_level="critical", access_log=False, timeout_graceful_shutdown=1, server_header=False)
    server = uvicorn.Server(config)
    serving = asyncio.create_task(server.serve([listening]))
    while not (is_stopped() or serving.done()):
        await asyncio.sleep(_LOOK)
    server.should_exit = True
    await serving
