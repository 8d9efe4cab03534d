"""A running app is of its user alone: other users, other servers and other people's folders get nothing from it."""

import base64
import http.client
import os
import re
import shutil
import signal
import socket
import stat
import struct
import time
from contextlib import closing
from pathlib import Path
from urllib.parse import quote, urlsplit

import pytest
from app_in_browser import served

from bowdenfit.addons.app.scratch import scratch_folder
from bowdenfit.pages.page import page_policy

DATASETS = Path(__file__).parents[3] / "datasets"
pytestmark = pytest.mark.extended


class Browser:
    """A browser without a window, which has opened an address."""

    def __init__(self, app, address=""):
        self.port = app.port
        parts = urlsplit(address or app.new_address())
        answer, page = self.get(f"{parts.path}?{parts.query}", root="", headers={})
        assert answer.status == 200, page
        cookie = answer.getheader("set-cookie").partition(";")[0]
        self.root, self.headers = re.search(r"url=(/[^/]+)/", page.decode())[1], {"cookie": cookie}

    def get(self, path, root=None, headers=None, method="GET", body=None):
        """An answer and its content."""
        with closing(http.client.HTTPConnection("127.0.0.1", self.port)) as connection:
            headers = self.headers if headers is None else headers
            connection.request(method, f"{self.root if root is None else root}{path}", body, headers)
            answer = connection.getresponse()
            return answer, answer.read()

    def begin(self, request, **headers):
        """A connection on which a request has been sent, which may not be whole."""
        connection = socket.create_connection(("127.0.0.1", self.port))
        lines = [f"host: 127.0.0.1:{self.port}", *(f"{name}: {value}" for name, value in (self.headers | headers).items())]
        connection.sendall("\r\n".join([request, *lines, "", ""]).encode())
        return connection


def command_lines():
    """Command lines of all processes, which every user can read."""
    lines = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            lines.append(path.read_bytes().decode(errors="replace"))
        except OSError:
            continue
    return lines


@pytest.fixture
def bench(tmp_path, quick_results):
    """A folder with a data set and a fit."""
    shutil.copytree(DATASETS / "yarn-on-cylinder", tmp_path / "bench" / "yarn")
    shutil.copytree(quick_results, tmp_path / "bench" / "fits" / "on-body")
    return tmp_path / "bench"


def test_no_command_line_has_a_key_and_a_browser_that_does_not_return_keeps_nobody_waiting(bench, tmp_path):
    """The browser gets a file that its user alone can read."""
    opened = tmp_path / "opened"
    program = tmp_path / "browser"
    program.write_text(f'#!/bin/sh\nexec >/dev/null 2>&1\nprintf %s "$1" > {opened}.new\nmv {opened}.new {opened}\nsleep 60\n')
    program.chmod(0o755)
    environment = os.environ | {"BROWSER": f"{program} %s", "TMPDIR": str(tmp_path)}
    with served(bench, "--port", "0", env=environment) as app:
        browsers = [Browser(app)]
        deadline = time.monotonic() + 20
        while not opened.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        page = Path(opened.read_text().removeprefix("file://"))
        assert stat.S_IMODE(page.stat().st_mode) == 0o600 and stat.S_IMODE(page.parent.stat().st_mode) == 0o700
        address = re.search(r"url=([^\"]+)", page.read_text())[1]
        key = address.partition("key=")[2]
        assert len(key) > 20
        lines = command_lines()
        assert any(page.name in line for line in lines)
        assert not [line for line in lines if key in line or browsers[0].root.strip("/") in line]
        browsers.append(Browser(app, address))
        for browser in browsers:
            assert browser.get("/")[0].status == 200
        again, words = browsers[0].get(f"/?key={key}", root="", headers={})
        assert (again.status, b"each opens the app once" in words) == (403, True)


def test_nothing_is_answered_without_a_session_and_its_cookie(bench):
    with served(bench) as app:
        browser, other = Browser(app), Browser(app)
        paths = (
            "/", "/fit/on-body", "/data/yarn", "/assets/app.js", "/kept/on-body/report.html", "/export/on-body/csv",
            "/_nicegui_ws/socket.io/?EIO=4&transport=polling",
        )  # fmt: skip
        for path in paths:
            assert browser.get(path)[0].status == 200, path
            for root, headers in (("", browser.headers), (browser.root, {}), (browser.root, other.headers)):
                assert browser.get(path, root, headers)[0].status == 403, (path, root, headers)
        assert browser.get("/upload/x?name=a.csv", "", browser.headers, "PUT", b"1")[0].status == 403


def test_links_in_a_results_folder_lead_nowhere_and_reports_run_our_scripts_alone(bench, tmp_path):
    (tmp_path / "secret.txt").write_text("secret")
    results = bench / "fits" / "on-body"
    hostile = '<!doctype html><script src="http://evil.example/x.js"></script><img src="http://evil.example/x.png">'
    for name in ("details.txt", "summary.txt", "figures/efficiency.png"):
        (results / name).unlink()
        (results / name).symlink_to(tmp_path / "secret.txt")
    (results / "report.html").write_text(hostile)
    with served(bench) as app:
        browser = Browser(app)
        for name in ("details.txt", "summary.txt", "efficiency.png"):
            answer, content = browser.get(f"/kept/on-body/{name}")
            assert (answer.status, b"is a link" in content, content == b"secret") == (404, True, False)
        answer, _ = browser.get("/kept/on-body/report.html")
        assert answer.getheader("content-security-policy") == f"{page_policy()}; sandbox allow-scripts"
        assert "default-src 'none'" in page_policy() and "http" not in page_policy()


def test_names_are_opened_whatever_letters_they_have_and_what_no_address_can_have_is_counted(bench):
    for name in ("a%2fb", "a#b", "a?b=c", "a&b", "ä ö", "a\nb"):
        shutil.copytree(bench / "yarn", bench / name)
    shutil.copytree(bench / "fits" / "on-body", bench / "fits" / "x#%2f?")
    with served(bench) as app:
        browser = Browser(app)
        _, start = browser.get("/")
        for name in ("a%2fb", "a#b", "a?b=c", "a&b", "ä ö"):
            assert quote(name, safe="").encode() in start
            answer, page = browser.get(f"/data/{quote(name, safe='')}")
            assert (answer.status, b"no data set" in page) == (200, False), name
        assert b"1 data set cannot be opened here" in start
        answer, page = browser.get(f"/fit/{quote('x#%2f?', safe='')}")
        assert (answer.status, b"no fit" in page) == (200, False)
        assert browser.get(f"/kept/{quote('x#%2f?', safe='')}/summary.txt")[0].status == 200


def test_browsers_that_wait_no_longer_and_refused_ones_leave_no_traceback(bench):
    with served(bench) as app:
        browser = Browser(app)
        upgrade = {
            "upgrade": "websocket", "connection": "Upgrade", "sec-websocket-version": "13",
            "sec-websocket-key": base64.b64encode(bytes(16)).decode(),
        }  # fmt: skip
        socket_path = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
        requests = [
            (f"GET {browser.root}{socket_path} HTTP/1.1", upgrade),
            (f"GET {socket_path} HTTP/1.1", upgrade),
            (f"GET {browser.root}{socket_path} HTTP/1.1", upgrade | {"origin": "http://evil.example"}),
            (f"GET {browser.root}/ HTTP/1.1", {}),
            (f"GET {browser.root}/data/yarn HTTP/1.1", {}),
            (f"GET {browser.root}/kept/on-body/posterior.nc HTTP/1.1", {}),
            (f"GET {browser.root}/export/on-body/csv HTTP/1.1", {}),
            (f"PUT {browser.root}/upload/x?name=x.csv HTTP/1.1", {"content-length": "100000"}),
            ("nonsense", {}),
        ]
        for request, headers in requests:
            for wait in (0.0, 0.3):
                connection = browser.begin(request, **headers)
                time.sleep(wait)
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # aborted, not closed
                connection.close()
        time.sleep(1)
        assert browser.get("/")[0].status == 200
    assert "".join(app.errors).strip() in {"", "Interrupted."}


def test_what_a_killed_app_leaves_is_cleared_by_the_next_and_that_of_a_running_one_is_not(bench, tmp_path):
    place = tmp_path / "temporary"
    place.mkdir()
    environment = os.environ | {"TMPDIR": str(place)}
    with served(bench, env=environment) as killed, served(bench, env=environment) as running:
        Browser(killed).get("/")
        killed.process.send_signal(signal.SIGKILL)
        killed.process.wait()
        left = sorted(place.glob("bowdenfit-app-*"))
        assert len(left) == 2
        for folder in left:
            os.utime(folder, (0, 0))  # as if both were old
        with served(bench, env=environment):
            assert len(list(place.glob("bowdenfit-app-*"))) == 2
        assert Browser(running).get("/")[0].status == 200
    assert list(place.iterdir()) == []


def test_the_folder_for_temporary_files_is_not_cleared_through_links_or_for_other_users(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept" / "file").touch()
    (tmp_path / "bowdenfit-app-link").symlink_to(tmp_path / "kept")
    (tmp_path / "bowdenfit-app-young").mkdir()
    with scratch_folder() as folder:
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bowdenfit-app-link", "bowdenfit-app-young", "kept"]
    assert (tmp_path / "kept" / "file").exists()
