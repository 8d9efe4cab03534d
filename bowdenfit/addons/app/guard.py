"""Who may ask the app for anything: a browser that opened an address of the terminal, from a page of the app itself.

Each address has a key that opens the app once. The browser exchanges it for two things: a session in its address, which each
page and its websocket repeat, and a cookie, which it sends only to addresses with that session. Either is worthless without the
other: cookies are not bound to a port, so another server on this machine may get them; and an address may be copied.
"""

import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from html import escape
from http.cookies import CookieError, SimpleCookie
from typing import Any, TypeAlias
from urllib.parse import parse_qs

Message: TypeAlias = MutableMapping[str, Any]
Receive: TypeAlias = Callable[[], Awaitable[Message]]
Send: TypeAlias = Callable[[Message], Awaitable[None]]
Asgi: TypeAlias = Callable[[Message, Receive, Send], Awaitable[None]]
Headers: TypeAlias = tuple[tuple[bytes, bytes], ...]
HOST = "127.0.0.1"
LARGEST_REQUEST = 1 << 30  # bytes of one upload; recordings of hours have some hundred megabytes
_SECRET_BYTES = 24  # of a key, a session and a cookie: more than can be guessed
_OK, _FORBIDDEN, _TOO_LARGE, _FAILED = 200, 403, 413, 500
_PLAIN, _HTML = b"text/plain; charset=utf-8", b"text/html; charset=utf-8"
_HEADERS: Headers = (  # of every answer
    (b"referrer-policy", b"no-referrer"),
    (b"x-content-type-options", b"nosniff"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"cross-origin-opener-policy", b"same-origin"),
)
_POLICY = (  # Vue compiles its templates in the page, so that script-src cannot be stricter
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self' ws://{host}; object-src 'none'; base-uri 'none'; "
    "form-action 'self'; frame-ancestors 'none'"
)
_NO_SESSION = (
    "This address is not valid, or was used before: each opens the app once. Open the one that `bowdenfit app` printed last."
)


def entry_page(address: str) -> str:
    """HTML page that goes on to an address; after a redirect, a browser that a file sent here would send no cookie.

    Args:
        address: Where to go.
    """
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>bowdenfit</title>'
        f'<meta http-equiv="refresh" content="0; url={escape(address)}">'
        f'<p><a href="{escape(address)}">Open the app</a></p></html>\n'
    )


class Guard:
    """The app behind a check of host, origin, session and cookie; what fails it is refused in a sentence, websockets too.

    Args:
        app: Answers those who pass.
        port: Port that the app listens on.
        on_entry: Called with each key that was used.
        on_error: Called with what goes wrong while a browser waits for its answer.
    """

    def __init__(
        self, app: Asgi, port: int, on_entry: Callable[[str], None], on_error: Callable[[Exception], None]
    ) -> None:
        self._app, self._port, self._on_entry, self._on_error = app, port, on_entry, on_error
        self._hosts = {f"{name}:{port}" for name in (HOST, "localhost")}
        self._cookie = f"bowdenfit-{port}"
        self._keys: set[str] = set()
        self._cookies: dict[str, str] = {}  # by session

    def new_key(self) -> str:
        """Key that opens the app once."""
        self._keys.add(key := secrets.token_urlsafe(_SECRET_BYTES))
        return key

    def address(self, key: str) -> str:
        """Address that opens the app with a key."""
        return f"http://{HOST}:{self._port}/?key={key}"

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Answer a request, refuse it, or exchange its key for a session."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        key = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("key", [""])[0]
        root = self._find_root(scope["path"], headers)
        if refusal := self._refuse_foreign(headers, scope):
            await _answer(scope, send, _FORBIDDEN, refusal)
        elif not root and _is_entry(scope) and self._take_key(key):
            await self._enter(scope, send)
            self._on_entry(key)
        elif not root:
            await _answer(scope, send, _FORBIDDEN, _NO_SESSION)
        elif int(headers.get("content-length") or 0) > LARGEST_REQUEST:
            await _answer(scope, send, _TOO_LARGE, "A file of more than 1 GiB is not taken; name its folder instead.")
        else:
            policy = (b"content-security-policy", _POLICY.format(host=headers["host"]).encode())
            client = _Client(receive, send, (*_HEADERS, policy))
            try:
                await self._app({**scope, "root_path": root}, client.receive, client.send)
            except Exception as error:
                if not client.is_gone:
                    self._on_error(error)
                if not (client.is_gone or client.is_answered):
                    await _answer(scope, send, _FAILED, "Something went wrong inside bowdenfit; the terminal says what.")

    def _refuse_foreign(self, headers: dict[str, str], scope: Message) -> str:
        """Why a request from elsewhere is refused; empty if it is not from elsewhere."""
        if headers.get("host", "") not in self._hosts:
            return f"This page is served to this machine alone; open it as http://{HOST}:{self._port}."
        origin, site = headers.get("origin"), headers.get("sec-fetch-site", "same-origin")
        is_foreign = origin is not None and origin not in {f"http://{host}" for host in self._hosts}
        is_navigation = headers.get("sec-fetch-mode") == "navigate" and scope.get("method") == "GET"
        if is_foreign or (site not in {"same-origin", "none"} and not is_navigation):
            return "A page of another site asked for this, and nothing was done; use the page of the app itself."
        return ""

    def _find_root(self, path: str, headers: dict[str, str]) -> str:
        """Part of an address that is its session, if the cookie is that of the session; else empty."""
        first, cookie = path[1:].partition("/")[0].encode(), _read_cookie(headers, self._cookie).encode()
        for session, expected in self._cookies.items():
            if secrets.compare_digest(first, session.encode()) and secrets.compare_digest(cookie, expected.encode()):
                return f"/{session}"
        return ""

    def _take_key(self, key: str) -> bool:
        """Whether a key has not been used; it is from now on."""
        is_new = key in self._keys
        self._keys.discard(key)
        return is_new

    async def _enter(self, scope: Message, send: Send) -> None:
        """Begin a session."""
        session, cookie = secrets.token_urlsafe(_SECRET_BYTES), secrets.token_urlsafe(_SECRET_BYTES)
        self._cookies[session] = cookie
        header = f"{self._cookie}={cookie}; Path=/{session}/; HttpOnly; SameSite=Strict".encode()
        policy = (b"content-security-policy", b"default-src 'none'; frame-ancestors 'none'; base-uri 'none'")
        await _answer(scope, send, _OK, entry_page(f"/{session}/"), _HTML, ((b"set-cookie", header), policy))


def _is_entry(scope: Message) -> bool:
    """Whether a request is one for which a key counts."""
    return scope["type"] == "http" and scope["method"] == "GET" and scope["path"] == "/"


def _read_cookie(headers: dict[str, str], name: str) -> str:
    """Value of a cookie; empty without it."""
    try:
        cookie = SimpleCookie(headers.get("cookie", "")).get(name)
    except CookieError:
        return ""
    return cookie.value if cookie else ""


class _Client:
    """Who waits for an answer.

    Args:
        receive: Gives its messages.
        send: Sends messages to it.
        headers: Further headers of the answer, for those that it has not itself.
    """

    def __init__(self, receive: Receive, send: Send, headers: Headers) -> None:
        self._receive, self._send, self._headers = receive, send, headers
        self._taken, self.is_gone, self.is_answered = 0, False, False

    async def receive(self) -> Message:
        """The next message; the last if an upload grows beyond what it may have, whatever its stated length."""
        message = await self._receive()
        self._taken += len(message.get("body", b"")) if message["type"] == "http.request" else 0
        if self._taken > LARGEST_REQUEST:
            message = {"type": "http.disconnect"}
        self.is_gone = self.is_gone or message["type"] in {"http.disconnect", "websocket.disconnect"}
        return message

    async def send(self, message: Message) -> None:
        """Send a part of the answer."""
        if message["type"] == "http.response.start":
            own = {name.lower() for name, _ in message.get("headers", ())}
            message["headers"] = [*message.get("headers", ()), *(pair for pair in self._headers if pair[0] not in own)]
        self.is_answered = True
        await self._send(message)


async def _answer(
    scope: Message, send: Send, status: int, text: str, media_type: bytes = _PLAIN, headers: Headers = ()
) -> None:
    """Answer without asking the app; a websocket is answered before it opens."""
    kind = "http.response"
    if scope["type"] == "websocket":
        if "websocket.http.response" not in scope.get("extensions", {}):
            await send({"type": "websocket.close", "code": 1008, "reason": text[:120]})
            return
        kind = "websocket.http.response"
    all_headers = [(b"content-type", media_type), (b"cache-control", b"no-store"), *_HEADERS, *headers]
    await send({"type": f"{kind}.start", "status": status, "headers": all_headers})
    await send({"type": f"{kind}.body", "body": text.encode()})
