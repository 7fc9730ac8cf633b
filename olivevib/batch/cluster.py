"""A batch on a Dask cluster: the scheduler hands trials to workers that see the same folders.

Whoever reaches a scheduler without TLS can run any code on its workers; so it is loopback or TLS.
"""

from __future__ import annotations

import ipaddress
import logging
import queue
import socket
import uuid
from collections.abc import Generator, Iterator, Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from olivevib.batch.outlook import Outlook
from olivevib.batch.remote import measure_remotely
from olivevib.batch.result import TrialResult
from olivevib.errors import InputError, OlivevibError, UsageError
from olivevib.progress import Tick, silent

POLL_S = 0.25
ANSWERS_S = 10
NOBODY = "no worker is connected yet"
START = (
    "Start one: dask scheduler --host 127.0.0.1, then a worker a core: "
    "dask worker ADDRESS --nworkers 2 --nthreads 1"
)


def measure_on_cluster(
    trials: Sequence[Path], address: str, tick: Tick = silent
) -> Generator[TrialResult, None, None]:
    """Measure every trial on the workers of a Dask scheduler; yields results as they come.

    Workers must see the trials under the same names. A trial whose worker dies goes to another
    one, as often as the scheduler's allowed-failures say. When the tick raises, waiting trials
    are withdrawn and running ones stop at the next safe place. Raises UsageError for an address
    that is neither loopback nor TLS or where distributed is not installed, InputError where no
    scheduler answers.
    """
    check_address(address)
    client = _connect(address)
    try:
        yield from _results(client, [str(t) for t in trials], tick)
    finally:
        with suppress(OSError):
            client.close()


def check_address(address: str) -> None:
    """UsageError where the address is neither on this machine nor behind TLS."""
    scheme, host, port = _parts(address)
    if port and (scheme == "tls" or (scheme == "tcp" and _is_here(host))):
        return
    if scheme != "tcp" or not port:
        raise UsageError(
            f"--scheduler {address} is no address of a scheduler.",
            "",
            "Write tcp://127.0.0.1:8786 on this machine, tls://HOST:8786 for another one.",
        )
    raise UsageError(
        f"--scheduler {address} is on another machine and not encrypted.",
        "Whoever reaches a Dask scheduler without TLS can run any code on its workers.",
        "Set up TLS (https://distributed.dask.org/en/stable/tls.html) and write "
        f"tls://{host}:{port}, or tunnel it: ssh -L {port}:localhost:{port} {host}, "
        f"and write tcp://127.0.0.1:{port}.",
    )


def _parts(address: str) -> tuple[str, str, int]:
    """Scheme (tcp where none is written), host and port of an address; 0 where it has no port."""
    try:
        parts = urlsplit(address if "://" in address else f"tcp://{address}")
        return parts.scheme, parts.hostname or "", parts.port or 0
    except ValueError:
        return "", "", 0


def _is_here(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _connect(address: str) -> Any:
    try:
        distributed = import_module("distributed")
    except ImportError as error:
        raise UsageError(
            "batch on a cluster needs the package distributed, which is not installed.",
            "",
            "Install it: pip install 'olivevib[cluster]'; --workers N needs nothing more.",
        ) from error
    scheme, host, port = _parts(address)
    try:
        if scheme == "tls" and not _has_certificates(distributed.Security()):
            raise _no_certificates(address)
        socket.create_connection((host, port), ANSWERS_S).close()
        # what it would log with tracebacks, a person gets in words
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL + 1)
        return distributed.Client(address, timeout=ANSWERS_S, set_as_default=False)
    except (OSError, TypeError, ValueError, RuntimeError) as error:
        raise InputError(f"no scheduler answers at {address}.", f"{error}", START) from error


def _has_certificates(security: Any) -> bool:
    return bool(security.get_connection_args("client").get("ssl_context"))


def _no_certificates(address: str) -> UsageError:
    return UsageError(
        f"--scheduler {address} needs certificates, and none are configured here.",
        "A connection by TLS proves both ends to each other.",
        "Name them in ~/.config/dask/distributed.yaml under comm.tls (ca-file, client.cert, "
        "client.key): https://distributed.dask.org/en/stable/tls.html",
    )


def _gone(why: str) -> InputError:
    return InputError(
        "the scheduler is gone.",
        why,
        "What is done is kept. Start it and its workers again, and run the same command.",
    )


def _results(client: Any, trials: list[str], tick: Tick) -> Iterator[TrialResult]:
    inbox: queue.Queue[Any] = queue.Queue()
    outlook = Outlook(len(trials), 1)
    futures = _submit(client, trials, inbox)
    try:
        while outlook.left:
            outlook.workers = _workers(client)
            outlook.note(f"{outlook.workers} at work" if outlook.workers else NOBODY)
            tick(*outlook.progress())
            try:
                future = inbox.get(timeout=POLL_S)
            except queue.Empty:
                continue
            result = _result(future, futures[future.key][0])
            del futures[future.key]
            outlook.finished(result)
            yield result
        tick(*outlook.progress())
    finally:
        with suppress(OSError):  # the scheduler is gone
            client.cancel([future for _, future in futures.values()])


def _submit(client: Any, trials: list[str], inbox: queue.Queue[Any]) -> dict[str, tuple[str, Any]]:
    """Hand in every trial: key -> trial and future, which comes into ``inbox`` when it is done."""
    batch = uuid.uuid4().hex
    futures = {}
    for number, trial in enumerate(trials):
        key = f"{Path(trial).name}-{batch}-{number}"
        future = client.submit(measure_remotely, trial, key=key, pure=False)
        future.add_done_callback(inbox.put)
        futures[key] = trial, future
    return futures


def _workers(client: Any) -> int:
    try:
        return len(client.nthreads())
    except OSError as error:
        raise _gone(str(error)) from error


def _result(future: Any, trial: str) -> TrialResult:
    if future.status == "finished":
        return TrialResult.from_json(future.result())
    if future.status != "error":
        raise _gone("It has let go of the trials it was given.")
    try:
        reason = str(future.exception())
    except Exception as error:  # what was raised there cannot even be read here
        reason = str(error)
    return TrialResult.failure(
        trial,
        OlivevibError(
            f"{Path(trial).name} came back without a result.",
            reason.strip()[:500],
            "Check that every worker has this olivevib and sees the trial under the same name, "
            "and look into the workers' logs; then run the same command again.",
        ),
    )
