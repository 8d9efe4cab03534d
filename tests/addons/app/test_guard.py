"""Who may ask the app: a browser that opened an address of the terminal, from the app's own pages, by websocket too."""

import asyncio

import pytest

from bowdenfit.addons.app.draft import refuse_file_name
from bowdenfit.addons.app.guard import LARGEST_REQUEST, Guard
from bowdenfit.addons.app.workbench import refuse_folder_name
from bowdenfit.errors import UsageError

PORT = 4711
ANSWERING = ("websocket.http.response",)
HOST = {"host": f"127.0.0.1:{PORT}"}


def request(guard, path, headers=HOST, kind="http", method="GET", body=b"", message="http.request", extensions=ANSWERING):
    """What a request is answered, as messages; "passed" if it reached the app behind the guard."""
    sent = []
    path, _, query = path.partition("?")

    async def receive():
        return {"type": message, "body": body}

    async def send(message):
        sent.append(message)

    scope = {"type": kind, "method": method, "path": path, "query_string": query.encode()}
    scope["extensions"] = dict.fromkeys(extensions)
    scope["headers"] = [(name.encode(), value.encode()) for name, value in headers.items()]
    guard.sent = sent
    asyncio.run(guard(scope, receive, send))
    return sent


class WatchedGuard(Guard):
    """A guard that notes which keys were used, and of each request that passes where it went."""

    def __init__(self):
        self.used, self.sent = [], []
        self.errors = []
        super().__init__(self._pass, PORT, self.used.append, self.errors.append)

    async def _pass(self, scope, receive, send):
        received = await receive()
        if scope["path"].endswith("/fails"):
            raise ZeroDivisionError("not foreseen")
        self.sent.append({"type": "passed", "received": received["type"], "root": scope["root_path"]})
        await send({"type": "http.response.start", "status": 200, "headers": []})


@pytest.fixture
def guard():
    """A guard."""
    return WatchedGuard()


def enter(guard, host=HOST):
    """Use a key; return the root of the session and the headers of its browser."""
    by_file = {"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate"}
    start, body = request(guard, f"/?key={guard.new_key()}", host | by_file)
    assert start["status"] == 200
    name, _, value = dict(start["headers"])[b"set-cookie"].decode().partition(";")[0].partition("=")
    root = body["body"].decode().partition("url=")[2].partition('"')[0]
    return root.rstrip("/"), host | {"cookie": f"{name}={value}"}


def passes(guard, path, headers, **more):
    """Whether a request reaches the app."""
    return request(guard, path, headers, **more)[0]["type"] == "passed"


def test_a_key_works_once_and_is_exchanged_for_a_session_and_a_cookie_that_do_not_contain_it(guard):
    key = guard.new_key()
    start, body = request(guard, f"/?key={key}")
    cookie = dict(start["headers"])[b"set-cookie"].decode()
    assert start["status"] == 200
    assert key not in cookie and key not in body["body"].decode()
    root = body["body"].decode().partition("url=")[2].partition('"')[0]
    assert cookie.endswith(f"Path={root}; HttpOnly; SameSite=Strict")
    assert guard.used == [key]
    start, body = request(guard, f"/?key={key}")
    assert (start["status"], b"each opens the app once" in body["body"]) == (403, True)
    assert guard.used == [key]


def test_the_cookie_is_worthless_without_the_session_of_the_address_and_the_other_way_round(guard):
    (root, browser), (other_root, other_browser) = enter(guard), enter(guard)
    for kind in ("http", "websocket"):
        assert passes(guard, f"{root}/fit/x", browser, kind=kind)
        for path in ("/", "/fit/x", f"{root}x/fit/x", f"/x{root}/", f"{other_root}/fit/x", "/_nicegui_ws/socket.io"):
            assert not passes(guard, path, browser, kind=kind), path
        for headers in (HOST, other_browser, HOST | {"cookie": f"bowdenfit-{PORT}=wrong"}, HOST | {"cookie": "=;;\x7f"}):
            assert not passes(guard, f"{root}/fit/x", headers, kind=kind), headers
    assert request(guard, f"{root}/fit/x", browser)[0]["root"] == root


def test_a_key_opens_the_start_page_alone_and_leads_nowhere_else(guard):
    for path in ("//evil.com/", "/fit/x", "/kept/x/report.html"):
        assert request(guard, f"{path}?key={guard.new_key()}")[0]["status"] == 403
    assert request(guard, f"/?key={guard.new_key()}", method="POST")[0]["status"] == 403
    assert request(guard, f"/?key={guard.new_key()}", kind="websocket")[0]["status"] == 403


REFUSED = [
    ({"host": "evil.example"}, "this machine alone"),
    ({"host": f"127.0.0.1.evil.example:{PORT}"}, "this machine alone"),
    ({"host": "127.0.0.1:80"}, "this machine alone"),
    (HOST | {"origin": "http://evil.example"}, "another site"),
    (HOST | {"origin": "null"}, "another site"),
    (HOST | {"origin": "http://127.0.0.1:80"}, "another site"),
    (HOST | {"origin": f"https://127.0.0.1:{PORT}"}, "another site"),
    (HOST | {"origin": f"chrome-extension://127.0.0.1:{PORT}"}, "another site"),
    (HOST | {"sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors"}, "another site"),
    (HOST | {"sec-fetch-site": "same-site", "sec-fetch-mode": "websocket"}, "another site"),
]


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(("headers", "words"), REFUSED)
def test_other_hosts_and_origins_are_refused_in_a_sentence_whatever_session_they_have(guard, headers, words, kind):
    root, browser = enter(guard)
    start, body = request(guard, f"{root}/", browser | headers, kind=kind)
    assert start["type"].endswith("response.start")
    assert start["status"] == 403
    assert words in body["body"].decode()


def test_the_origin_of_the_app_itself_passes(guard):
    for host in (f"127.0.0.1:{PORT}", f"localhost:{PORT}"):
        root, browser = enter(guard, {"host": host})
        assert passes(guard, f"{root}/", browser | {"origin": f"http://{host}"}, kind="websocket")


def test_a_server_that_cannot_answer_a_websocket_closes_it(guard):
    (message,) = request(guard, "/", kind="websocket", extensions=())
    assert message["type"] == "websocket.close"


def test_an_upload_without_end_ends(guard):
    root, browser = enter(guard)
    large = browser | {"content-length": str(LARGEST_REQUEST + 1)}
    start, body = request(guard, f"{root}/upload/x", large, method="PUT")
    assert (start["status"], b"1 GiB" in body["body"]) == (413, True)
    passed = request(guard, f"{root}/upload/x", browser, method="PUT", body=b"x" * 10)
    assert passed[0]["received"] == "http.request"


def test_what_passes_may_load_and_send_nothing_elsewhere(guard):
    root, browser = enter(guard)
    headers = dict(request(guard, f"{root}/", browser)[1]["headers"])
    policy = headers[b"content-security-policy"].decode()
    assert "default-src 'self'" in policy
    assert f"connect-src 'self' ws://127.0.0.1:{PORT};" in policy
    assert "http:" not in policy and "ws: " not in policy
    assert headers[b"referrer-policy"] == b"no-referrer"


def test_an_error_is_reported_once_and_answered_with_a_sentence_unless_nobody_waits(guard):
    root, browser = enter(guard)
    start, body = request(guard, f"{root}/fails", browser)
    assert (start["status"], b"the terminal says what" in body["body"]) == (500, True)
    assert [str(error) for error in guard.errors] == ["not foreseen"]
    assert request(guard, f"{root}/fails", browser, message="http.disconnect") == []
    assert len(guard.errors) == 1


HOSTILE = [
    "", ".", "..", "../forces.csv", "a/b.csv", "a\\b.csv", "/etc/passwd", "C:\\x.csv", "x\0.csv", "x\n.csv", "\u202efdp.csv",
    ".hidden", "-rf", "~\t", "x" * 300, "cable.toml", "CABLE.TOML", "a?.csv", "a*.csv", '"a".csv',
    "<b>.csv", "a|b", "x.csv.", " x.csv", "CON.csv", "lpt1.xlsx",
]  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_names_of_files_are_refused(name):
    with pytest.raises(UsageError, match="cannot be the name"):
        refuse_file_name(name)


@pytest.mark.parametrize("name", [*(n for n in HOSTILE if "toml" not in n.lower()), "fits/x", "con", "NUL.csv", "a:b"])
def test_hostile_names_of_folders_are_refused(name):
    with pytest.raises(UsageError, match="cannot be the name"):
        refuse_folder_name(name)


@pytest.mark.parametrize("name", ["forces.csv", "Lauf 1 (90 Grad).csv", "力.csv", "run-1_90deg.tdms"])
def test_usual_names_are_taken(name):
    refuse_file_name(name)
