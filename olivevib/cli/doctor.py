"""Verb doctor: what works on this machine."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path

from olivevib.cli.console import Console

MARKS = {"ok": "ok", "note": "note", "missing": "MISSING"}


def doctor(arguments: argparse.Namespace, console: Console) -> int:
    """Print every check; exit 1 where something that is needed is missing."""
    from olivevib.pipeline.machine import examine

    checks = examine(Path())
    missing = [c for c in checks if c.state == "missing"]
    if arguments.json:
        print(json.dumps([asdict(c) for c in checks], indent=2, ensure_ascii=False))
        return 1 if missing else 0
    group = ""
    for check in checks:
        if check.group != group:
            group = check.group
            print(group)
        print(f"  {MARKS[check.state]:8} {check.what:24} {check.words}")
    console.say("Everything that is needed is here." if not missing else "Something is missing.")
    return 1 if missing else 0
