"""What the documents say is what the code does."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def source() -> str:
    paths = sorted((ROOT / "olivevib").rglob("*.py"))
    return "\n".join(path.read_text(encoding="utf-8") for path in paths)


def test_every_warning_code_stands_in_format():
    table = (ROOT / "FORMAT.md").read_text(encoding="utf-8").split("## Warnings")[1]
    listed = set(re.findall(r"^\| `([a-z0-9-]+)` \|", table, re.MULTILINE))
    code = source()
    assert set(re.findall(r'Caution\(\s*"([a-z0-9-]+)"', code)) - listed == set()
    assert {word for word in listed if f'"{word}"' not in code} == set()


def test_every_warning_has_its_remedy_in_the_field_guide():
    rows = r"^\| `([a-z0-9-]+)` \| .+ \|$"
    format_ = (ROOT / "FORMAT.md").read_text(encoding="utf-8").split("## Warnings")[1]
    guide = (ROOT / "docs" / "field-guide.md").read_text(encoding="utf-8")
    listed = re.findall(rows, format_, re.MULTILINE)
    told = re.findall(r"^\| `([a-z0-9-]+)` \| .+ \| .+ \|$", guide, re.MULTILINE)
    assert sorted(told) == sorted(set(listed))
