"""The app in a browser: a page and a socket of this computer, for one origin only."""

from __future__ import annotations

import asyncio
import json
import signal
import socket
import subprocess
import sys
import time

import pytest
import tui_scene as scene

pytest.importorskip("textual_serve")
aiohttp = pytest.importorskip("aiohttp")

pytestmark = pytest.mark.slow
ELSEWHERE = "http://elsewhere.example"
START_S = 30.0


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def serve(folder, *options: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "olivevib", "serve", *options]
    return subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)


@pytest.fixture
def place(tmp_path):
    """Host and port of a server on a workspace with one trial; it ends cleanly on Ctrl-C."""
    folder = tmp_path / "olive"
    scene.new_trial(folder / "trials" / "T01")
    port = free_port()
    process = serve(folder, "--port", str(port))
    try:
        began = time.monotonic()
        while True:
            try:
                socket.create_connection(("127.0.0.1", port), 1).close()
                break
            except OSError:
                assert process.poll() is None and time.monotonic() - began < START_S
                time.sleep(0.1)
        yield f"127.0.0.1:{port}"
        process.send_signal(signal.SIGINT)
        assert process.wait(15) == 0
    finally:
        process.kill()
        process.communicate()


async def test_page_and_socket_are_this_computers_and_for_no_other_page(place):
    async with aiohttp.ClientSession() as browser:
        async with browser.get(f"http://{place}/") as answer:
            page = await answer.text()
            assert answer.status == 200
        assert page.count("http://") == page.count(f"http://{place}/static/") > 0
        assert "https://" not in page
        for headers in ({"Host": "elsewhere.example"}, {"Origin": ELSEWHERE}):
            for path in ("/", "/ws", "/static/js/textual.js"):
                async with browser.get(f"http://{place}{path}", headers=headers) as answer:
                    assert answer.status == 403, (headers, path)
        with pytest.raises(aiohttp.WSServerHandshakeError, match="403"):
            await browser.ws_connect(f"ws://{place}/ws", headers={"Origin": ELSEWHERE})


async def test_the_app_answers_in_the_page(place):
    here = {"Origin": f"http://{place}"}
    address = f"ws://{place}/ws?width=100&height=30"
    async with aiohttp.ClientSession() as browser, browser.ws_connect(address, headers=here) as ws:
        await until(ws, b"T01")
        await ws.send_str(json.dumps(["stdin", "?"]))
        await until(ws, b"Esc closes")
        await ws.send_str(json.dumps(["stdin", "\x1b"]))


async def until(ws, words: bytes) -> None:
    """Read what the app draws until these words are among it."""
    seen = b""
    async with asyncio.timeout(START_S):
        while words not in seen:
            message = await ws.receive()
            assert message.type in (aiohttp.WSMsgType.BINARY, aiohttp.WSMsgType.TEXT), message
            seen += message.data if isinstance(message.data, bytes) else b""


def test_a_taken_port_and_an_address_that_is_none_are_told(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        taken = str(listener.getsockname()[1])
        for options, words in ((["--port", taken], "--port"), (["--host", "0.0.0.0"], "--host")):
            process = serve(tmp_path, *options)
            told = process.communicate(timeout=60)[1].decode()
            assert process.returncode == 2
            assert words in told and "Traceback" not in told
