"""Serve the app to this machine until it is stopped."""

import asyncio
import secrets
import socket
import webbrowser
from collections.abc import Callable
from pathlib import Path
from threading import Event

import uvicorn
from fastapi import FastAPI
from nicegui import ui

from bowdenfit.app.guard import HOST, Guard
from bowdenfit.app.pages import register_pages
from bowdenfit.app.workbench import Workbench
from bowdenfit.errors import UsageError

_LOOK = 0.2  # s between two looks at whether to stop; a judgement
_KEY_BYTES = 24  # of the key in the address, more than can be guessed


def serve_app(folder: Path, port: int, browser: bool, stop: Event, say: Callable[[str], None]) -> None:
    """Serve the app until it is stopped; fits that run then end, and keep what is sampled.

    Args:
        folder: Where data sets and fits lie.
        port: On which this machine is asked; 0 for one that is free.
        browser: Whether to open the page in the default browser.
        stop: Set where the program is to stop.
        say: Prints the address.

    Raises:
        UsageError: There is no such folder, or the port is in use.
    """
    if not folder.is_dir():
        raise UsageError(f"{folder} is not a folder; name the one in which data sets and fits lie, or leave it out.")
    with _listen(port) as listening:
        bound, key = listening.getsockname()[1], secrets.token_urlsafe(_KEY_BYTES)
        workbench = Workbench(folder, stop)
        application = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
        register_pages(workbench, application)
        ui.run_with(
            application, title="bowdenfit", dark=None, language="en-US", tailwind=False, show_welcome_message=False,
            reconnect_timeout=60.0,  # s; JAX loads slowly on a busy machine
        )  # fmt: skip
        address = f"http://{HOST}:{bound}/?key={key}"
        say(f"The app is open at {address}\nCtrl-C ends it.")
        if browser:
            webbrowser.open(address)
        try:
            asyncio.run(_serve(Guard(application, bound, key), listening, stop))
        finally:
            workbench.close()


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


async def _serve(guarded: Guard, listening: socket.socket, stop: Event) -> None:
    """Serve until it is stopped."""
    config = uvicorn.Config(guarded, log_level="error", access_log=False, timeout_graceful_shutdown=1, server_header=False)
    server = uvicorn.Server(config)
    serving = asyncio.create_task(server.serve([listening]))
    while not (stop.is_set() or serving.done()):
        await asyncio.sleep(_LOOK)
    server.should_exit = True
    await serving
