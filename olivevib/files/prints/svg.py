"""A page as SVG with the mm as its unit."""

from __future__ import annotations

from xml.sax.saxutils import escape

from olivevib.files.prints.page import Area, Label, Line, Page, printable


def svg_text(page: Page, title: str = "") -> str:
    """The page as an SVG document of its true size; one user unit is one mm."""
    size = f'width="{_number(page.width_mm)}mm" height="{_number(page.height_mm)}mm"'
    box = f'viewBox="0 0 {_number(page.width_mm)} {_number(page.height_mm)}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} {box}>'
    ground = f'<rect width="{_number(page.width_mm)}" height="{_number(page.height_mm)}" '
    parts = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        head,
        f"<title>{escape(printable(title))}</title>",
        ground + 'fill="#fff"/>',
    ]
    parts += [_area(area) for area in page.areas]
    parts += [_line(line) for line in page.lines]
    parts += [_label(label) for label in page.labels]
    return "\n".join([*parts, "</svg>", ""])


def _area(area: Area) -> str:
    loops = []
    for loop in area.loops:
        points = " L".join(f"{_number(x)} {_number(y)}" for x, y in loop)
        loops.append(f"M{points} Z")
    return f'<path fill="#000" fill-rule="evenodd" d="{" ".join(loops)}"/>'


def _line(line: Line) -> str:
    (xa, ya), (xb, yb) = line.start, line.end
    ends = (
        f'x1="{_number(xa)}" y1="{_number(ya)}" x2="{_number(xb)}" y2="{_number(yb)}" '
        f'stroke-width="{_number(line.width_mm)}"'
    )
    level = round(255 * line.grey)
    dash = f' stroke-dasharray="{_number(line.dash_mm)}"' if line.dash_mm else ""
    return f'<line {ends} stroke="rgb({level},{level},{level})"{dash}/>'


def _label(label: Label) -> str:
    x, y = label.at
    where = f'x="{_number(x)}" y="{_number(y)}" font-size="{_number(label.height_mm)}"'
    family = 'font-family="Helvetica, Arial, sans-serif"'
    return f"<text {where} {family}>{escape(label.text)}</text>"


def _number(value: float) -> str:
    return f"{value:.4f}".rstrip("0").rstrip(".")
