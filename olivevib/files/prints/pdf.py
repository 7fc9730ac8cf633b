"""Pages as a vector PDF at exact scale, with printer scaling switched off."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

from olivevib.files.prints.page import Area, Label, Line, Page, printable

POINT_MM = 25.4 / 72


def pdf_bytes(pages: Sequence[Page], title: str = "") -> bytes:
    """The pages as a PDF 1.7 file; same pages, same bytes (no dates in it).

    Coordinates are written in mm to 1e-4 under one matrix that scales mm to points. The base font
    Helvetica is not embedded: every viewer has it or a substitute.
    """
    font = 3
    objects = [
        "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        f"<< /Type /Pages /Count {len(pages)} /Kids [{' '.join(_kids(len(pages)))}] >>",
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
        f"<< /Title ({_escape(title)}) /Producer (olivevib) >>",
    ]
    for number, page in enumerate(pages):
        content = _content(page)
        size = f"{_number(page.width_mm / POINT_MM)} {_number(page.height_mm / POINT_MM)}"
        objects.append(
            f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {size}] /Contents {6 + 2 * number} 0 R "
            f"/Resources << /Font << /F1 {font} 0 R >> >> >>"
        )
        objects.append(f"<< /Length {len(content)} >>\nstream\n{content}\nendstream")
    return _file(objects)


def _kids(count: int) -> list[str]:
    return [f"{5 + 2 * number} 0 R" for number in range(count)]


def _file(objects: list[str]) -> bytes:
    """Header, numbered objects, cross-reference table and trailer; catalog 1, information 4."""
    out = bytearray(b"%PDF-1.7\n%\xe2\xe3\xcf\xd3\n")
    starts = []
    for number, body in enumerate(objects, start=1):
        starts.append(len(out))
        out += f"{number} 0 obj\n{body}\nendobj\n".encode("cp1252")
    mark = hashlib.sha256(out).hexdigest()[:32]
    table = len(out)
    out += f"xref\n0 {len(objects) + 1}\n0000000000 65535 f \n".encode()
    out += "".join(f"{start:010d} 00000 n \n" for start in starts).encode()
    trailer = f"<< /Size {len(objects) + 1} /Root 1 0 R /Info 4 0 R /ID [<{mark}> <{mark}>] >>"
    out += f"trailer\n{trailer}\nstartxref\n{table}\n%%EOF\n".encode()
    return bytes(out)


def _content(page: Page) -> str:
    scale = 1 / POINT_MM
    down = f"{scale:.9f} 0 0 {-scale:.9f} 0 {page.height_mm * scale:.9f} cm"
    parts = ["q", down, "0 g"]
    parts += [_area(area) for area in page.areas]
    parts += [_line(line) for line in page.lines]
    parts += [_label(label) for label in page.labels]
    return "\n".join([*parts, "Q"])


def _area(area: Area) -> str:
    paths = []
    for loop in area.loops:
        points = [f"{_number(x)} {_number(y)}" for x, y in loop]
        paths.append(f"{points[0]} m " + " ".join(f"{point} l" for point in points[1:]) + " h")
    return "\n".join([*paths, "f*"])


def _line(line: Line) -> str:
    dash = f"[{_number(line.dash_mm)}]" if line.dash_mm else "[]"
    (xa, ya), (xb, yb) = line.start, line.end
    return (
        f"{_number(line.width_mm)} w {dash} 0 d {_number(line.grey)} G "
        f"{_number(xa)} {_number(ya)} m {_number(xb)} {_number(yb)} l S"
    )


def _label(label: Label) -> str:
    x, y = label.at
    size = _number(label.height_mm)
    upright = f"1 0 0 -1 {_number(x)} {_number(y)} Tm"
    return f"BT /F1 {size} Tf {upright} ({_escape(label.text)}) Tj ET"


def _number(value: float) -> str:
    return f"{value:.4f}".rstrip("0").rstrip(".")


def _escape(text: str) -> str:
    plain = printable(text).encode("cp1252", "replace").decode("cp1252")
    return plain.replace("\\", "\\\\").replace("(", "\\(").replace(")", "\\)")
