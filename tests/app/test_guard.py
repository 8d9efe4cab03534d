"""Who may ask the app: its own pages with the key, and nobody else, by websocket neither."""

import asyncio

import pytest

from bowdenfit.app.draft import refuse_file_name
from bowdenfit.app.guard import LARGEST_REQUEST, Guard
from bowdenfit.app.workbench import refuse_folder_name
from bowdenfit.errors import UsageError

PORT, KEY = 4711, "a-key-that-nobody-guesses"
HOST = {"host": f"127.0.0.1:{PORT}"}
COOKIE = {"cookie": f"bowdenfit-{PORT}={KEY}"}


def ask(headers, query="", kind="http", method="GET", body=b"", extensions=("websocket.http.response",)):
    """What a request is answered, as messages; "passed" where the app behind the guard is asked."""
    sent = []

    async def behind(scope, receive, send):
        received = await receive()
        sent.append({"type": "passed", "received": received["type"]})
        await send({"type": "http.response.start", "status": 200, "headers": []})

    async def receive():
        return {"type": "http.request", "body": body}

    async def send(message):
        sent.append(message)

    scope = {"type": kind, "method": method, "path": "/", "query_string": query.encode()}
    scope["extensions"] = dict.fromkeys(extensions)
    scope["headers"] = [(name.encode(), value.encode()) for name, value in headers.items()]
    asyncio.run(Guard(behind, PORT, KEY)(scope, receive, send))
    return sent


def test_the_key_in_the_address_becomes_a_cookie_that_no_script_reads_and_no_other_site_sends():
    start, _ = ask(HOST, f"key={KEY}")
    headers = dict(start["headers"])
    assert start["status"] == 303
    assert headers[b"location"] == b"/"
    assert headers[b"set-cookie"].endswith(b"Path=/; HttpOnly; SameSite=Strict")
    assert ask(HOST | COOKIE)[0]["type"] == "passed"


REFUSED = [
    ({"host": "evil.example"}, "this machine alone"),
    ({"host": f"127.0.0.1.evil.example:{PORT}"}, "this machine alone"),
    ({"host": "127.0.0.1:80"}, "this machine alone"),
    (HOST | {"origin": "http://evil.example"}, "another site"),
    (HOST | {"origin": "null"}, "another site"),
    (HOST | {"origin": "http://127.0.0.1:80"}, "another site"),
    (HOST | {"sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors"}, "another site"),
    (HOST | {"sec-fetch-site": "same-site", "sec-fetch-mode": "websocket"}, "another site"),
]


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(("headers", "words"), REFUSED)
def test_other_hosts_and_origins_are_refused_in_a_sentence_whatever_key_they_have(headers, words, kind):
    start, body = ask(headers | COOKIE, kind=kind)
    assert start["type"].endswith("response.start")
    assert start["status"] == 403
    assert words in body["body"].decode()


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize("cookie", ["", "bowdenfit-4711=wrong", "bowdenfit-80=" + KEY, "bowdenfit-4711=", "=;;\x7f"])
def test_who_has_no_key_is_told_to_open_the_whole_address(cookie, kind):
    start, body = ask(HOST | {"cookie": cookie}, kind=kind)
    assert start["status"] == 403
    assert "whole address" in body["body"].decode()


def test_a_server_that_cannot_answer_a_websocket_closes_it():
    (message,) = ask(HOST, kind="websocket", extensions=())
    assert message["type"] == "websocket.close"


def test_an_upload_without_end_ends():
    start, body = ask(HOST | COOKIE | {"content-length": str(LARGEST_REQUEST + 1)}, method="PUT")
    assert (start["status"], b"1 GiB" in body["body"]) == (413, True)
    passed = ask(HOST | COOKIE, method="PUT", body=b"x" * 10)
    assert passed[0]["received"] == "http.request"


def test_what_passes_is_told_to_load_nothing_from_elsewhere():
    headers = dict(ask(HOST | COOKIE)[1]["headers"])
    assert b"default-src 'self'" in headers[b"content-security-policy"]
    assert b"http:" not in headers[b"content-security-policy"]
    assert headers[b"referrer-policy"] == b"no-referrer"


HOSTILE = [
    "", ".", "..", "../forces.csv", "a/b.csv", "a\\b.csv", "/etc/passwd", "C:\\x.csv", "x\0.csv", "x\n.csv", "\u202efdp.csv",
    ".hidden", "-rf", "~\t", "x" * 300, "cable.toml", "CABLE.TOML", "a?.csv", "a*.csv", '"a".csv',
    "<b>.csv", "a|b", "x.csv.", " x.csv",
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
