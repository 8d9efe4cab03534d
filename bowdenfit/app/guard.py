"""Who may ask the app for anything: the browser of this machine that was given the key, from a page of the app itself."""

import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any, TypeAlias
from urllib.parse import parse_qs, quote

Message: TypeAlias = MutableMapping[str, Any]
Receive: TypeAlias = Callable[[], Awaitable[Message]]
Send: TypeAlias = Callable[[Message], Awaitable[None]]
Asgi: TypeAlias = Callable[[Message, Receive, Send], Awaitable[None]]
HOST = "127.0.0.1"
LARGEST_REQUEST = 1 << 30  # bytes of one upload; recordings of hours have some hundred megabytes
_FORBIDDEN, _TOO_LARGE, _SEE_OTHER = 403, 413, 303
_HEADERS = (  # of every answer; Vue compiles its templates in the page, so that script-src cannot be stricter
    (
        b"content-security-policy",
        b"default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
        b"img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self' ws:; object-src 'none'; base-uri 'none'; "
        b"form-action 'self'; frame-ancestors 'none'",
    ),
    (b"referrer-policy", b"no-referrer"),
    (b"x-content-type-options", b"nosniff"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"cross-origin-opener-policy", b"same-origin"),
)


class Guard:
    """The app behind a check of host, origin and key; what fails it is refused in a sentence, websockets too.

    Args:
        app: What answers those who pass.
        port: On which this machine is asked.
        key: What the address holds that the terminal prints; a cookie has it from then on.
    """

    def __init__(self, app: Asgi, port: int, key: str) -> None:
        self._app, self._port, self._key = app, port, key
        self._hosts = {f"{name}:{port}" for name in (HOST, "localhost")}
        self._cookie = f"bowdenfit-{port}"

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Answer a request, refuse it, or put the key of the address into a cookie."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        named_key = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("key", [""])[0]
        if refusal := self._refuse(headers, scope, named_key):
            await _answer(scope, send, _FORBIDDEN, refusal)
        elif int(headers.get("content-length") or 0) > LARGEST_REQUEST:
            await _answer(scope, send, _TOO_LARGE, "A file of more than 1 GiB is not taken; name its folder instead.")
        elif named_key and scope["type"] == "http":
            cookie = f"{self._cookie}={self._key}; Path=/; HttpOnly; SameSite=Strict".encode()
            await _answer(scope, send, _SEE_OTHER, "", ((b"location", quote(scope["path"]).encode()), (b"set-cookie", cookie)))
        else:
            await self._app(scope, _limited(receive), _with_headers(send))

    def _refuse(self, headers: dict[str, str], scope: Message, named_key: str) -> str:
        """Return why a request is refused; empty where it is not."""
        if headers.get("host", "") not in self._hosts:
            return f"This page is served to this machine alone; open it as http://{HOST}:{self._port}."
        origin, site = headers.get("origin"), headers.get("sec-fetch-site", "same-origin")
        is_foreign = origin is not None and origin.partition("://")[2] not in self._hosts
        is_navigation = headers.get("sec-fetch-mode") == "navigate" and scope.get("method") == "GET"
        if is_foreign or (site not in {"same-origin", "none"} and not is_navigation):
            return "A page of another site asked for this, and nothing was done; use the page of the app itself."
        if not secrets.compare_digest((named_key or _read_cookie(headers, self._cookie)).encode(), self._key.encode()):
            return "The address lacks the key of this app; open the whole address that `bowdenfit app` printed."
        return ""


def _read_cookie(headers: dict[str, str], name: str) -> str:
    """Return the value of a cookie; empty without it."""
    try:
        cookie = SimpleCookie(headers.get("cookie", "")).get(name)
    except CookieError:
        return ""
    return cookie.value if cookie else ""


def _limited(receive: Receive) -> Receive:
    """Return the same request, which ends where it grows beyond what an upload may have, whatever it said of its length."""
    taken = 0

    async def limited() -> Message:
        nonlocal taken
        message = await receive()
        taken += len(message.get("body", b"")) if message["type"] == "http.request" else 0
        return {"type": "http.disconnect"} if taken > LARGEST_REQUEST else message

    return limited


def _with_headers(send: Send) -> Send:
    """Return the same answer with the headers of `_HEADERS`, but for what it says itself."""

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            own = {name.lower() for name, _ in message.get("headers", ())}
            message["headers"] = [*message.get("headers", ()), *(pair for pair in _HEADERS if pair[0] not in own)]
        await send(message)

    return sending


async def _answer(
    scope: Message, send: Send, status: int, sentence: str, headers: tuple[tuple[bytes, bytes], ...] = ()
) -> None:
    """Answer by ourselves; a websocket is answered before it opens."""
    kind = "http.response"
    if scope["type"] == "websocket":
        if "websocket.http.response" not in scope.get("extensions", {}):
            await send({"type": "websocket.close", "code": 1008, "reason": sentence[:120]})
            return
        kind = "websocket.http.response"
    plain = ((b"content-type", b"text/plain; charset=utf-8"), (b"cache-control", b"no-store"), *_HEADERS[1:3])
    await send({"type": f"{kind}.start", "status": status, "headers": [*plain, *headers]})
    await send({"type": f"{kind}.body", "body": sentence.encode()})
