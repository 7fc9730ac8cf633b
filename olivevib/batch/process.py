"""One worker process as seen from the batch: started, given a trial, stopped, found dead."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import olivevib
from olivevib.batch.worker import STOP
from olivevib.threads import use_one_thread

STOPS_IN_S = 10.0  # a stage without a tick takes less; then the process is ended by force


@dataclass(frozen=True)
class Message:
    """What a worker tells: "ready", "tick", "result", or "ended" when its process is gone."""

    worker: WorkerProcess
    kind: str
    value: Any = None


class WorkerProcess:
    """A fresh Python with the batch's worker; its messages go into ``inbox``."""

    def __init__(self, inbox: queue.Queue[Message]) -> None:
        self.trial = ""
        self.ready = False
        self._inbox = inbox
        self._complaints = tempfile.TemporaryFile()  # noqa: SIM115 (closed with the process)
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "olivevib.batch.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._complaints,
            env=_environment(),
            start_new_session=True,  # Ctrl-C in the terminal reaches the batch alone
        )
        self._reader = threading.Thread(target=self._read, name="worker's messages", daemon=True)
        self._reader.start()

    def give(self, trial: str) -> None:
        """Hand it a trial; it must be ready and without one."""
        self.trial = trial
        self._order(trial)

    def stop(self) -> None:
        """Ask it to end: now if it waits, at the next safe place if it is at work."""
        self._order(STOP)

    def wait(self) -> None:
        """Wait for its end, which comes by force where it takes too long."""
        try:
            self._process.wait(STOPS_IN_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
        finally:
            self._forget()

    def epitaph(self) -> str:
        """How the process ended, and the last thing it complained about; call it once."""
        code = self._process.wait()
        self._complaints.seek(max(0, self._complaints.seek(0, os.SEEK_END) - 2000))
        said = self._complaints.read().decode("utf-8", "replace").strip().splitlines()
        self._forget()
        return _words(code) + (f": {said[-1][:300]}" if said else "")

    def _order(self, what: str) -> None:
        line = json.dumps(what).encode() + b"\n"
        with contextlib.suppress(OSError):  # it is dead: its reader tells
            self._stdin.write(line)
            self._stdin.flush()

    @property
    def _stdin(self) -> Any:
        return self._process.stdin

    def _read(self) -> None:
        for line in self._process.stdout or ():
            kind, value = json.loads(line)
            self.ready = True
            self._inbox.put(Message(self, kind, value))
        self._inbox.put(Message(self, "ended"))

    def _forget(self) -> None:
        with contextlib.suppress(OSError):
            self._stdin.close()
        self._process.wait()
        self._reader.join()
        if self._process.stdout:
            self._process.stdout.close()
        self._complaints.close()


def _environment() -> dict[str, str]:
    """One thread for every numeric library, and this very olivevib."""
    here = str(Path(olivevib.__file__).resolve().parents[1])
    paths = os.pathsep.join(p for p in (here, os.environ.get("PYTHONPATH")) if p)
    environment = os.environ | {"PYTHONPATH": paths}
    use_one_thread(environment)
    return environment


def _words(code: int) -> str:
    if code >= 0:
        return f"ended with code {code}"
    if code == -9:
        return "was ended by SIGKILL (often: the memory ran out)"
    with contextlib.suppress(ValueError):
        return f"was ended by {signal.Signals(-code).name}"
    return f"was ended by signal {-code}"
