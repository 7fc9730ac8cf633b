"""Pages and pictures to files: the ending of the name chooses PDF, SVG or PNG."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2

from olivevib.arrays import Grey
from olivevib.errors import InputError, UsageError
from olivevib.files.prints.page import Page
from olivevib.files.prints.pdf import pdf_bytes
from olivevib.files.prints.svg import svg_text


def write_pages(path: Path, pages: Sequence[Page], title: str = "") -> list[Path]:
    """Write a PDF with all pages, or SVG: one file a page, numbered where there are several.

    Returns the files written. Raises UsageError for another ending, InputError where the disk
    refuses.
    """
    ending = path.suffix.lower()
    if ending == ".pdf":
        return [_write(path, pdf_bytes(pages, title))]
    if ending == ".svg":
        many = len(pages) > 1
        names = [
            path.with_stem(f"{path.stem}-{k}") if many else path for k in range(1, len(pages) + 1)
        ]
        return [
            _write(name, svg_text(page, title).encode())
            for name, page in zip(names, pages, strict=True)
        ]
    raise UsageError(
        f"{path} cannot be written",
        f"A print is a PDF or an SVG, not {path.suffix or 'a name without ending'}.",
        "Let its name end in .pdf or .svg.",
    )


def write_picture(path: Path, picture: Grey) -> Path:
    """Write a grey picture as PNG; UsageError for another ending."""
    if path.suffix.lower() != ".png":
        raise UsageError(
            f"{path} cannot be written",
            f"One marker is drawn as PNG, not {path.suffix or 'a name without ending'}.",
            "Let the name after -o end in .png; `markers sheet` makes PDF and SVG.",
        )
    return _write(path, cv2.imencode(".png", picture)[1].tobytes())


def _write(path: Path, content: bytes) -> Path:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    except OSError as error:
        raise InputError(
            f"{path} cannot be written",
            error.strerror or str(error),
            "Choose another place.",
        ) from None
    return path
