"""What the documents say is what the code does."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def codes_in_code() -> set[str]:
    found = set()
    for path in (ROOT / "olivevib").rglob("*.py"):
        found |= set(re.findall(r'Caution\(\s*"([a-z0-9-]+)"', path.read_text(encoding="utf-8")))
    return found


def test_every_warning_code_stands_in_format():
    table = (ROOT / "FORMAT.md").read_text(encoding="utf-8").split("## Warnings")[1]
    listed = set(re.findall(r"^\| `([a-z0-9-]+)` \|", table, re.MULTILINE))
    assert codes_in_code() - listed == set()
    assert listed - codes_in_code() == set()
