"""Printing markers: pictures, sheets and boards at exact scale, as PNG, vector PDF and SVG."""

from olivevib.files.prints.board import board_page
from olivevib.files.prints.marker import marker_modules, marker_picture, marker_text
from olivevib.files.prints.page import PAPERS_MM, Page, paper_size
from olivevib.files.prints.pdf import pdf_bytes
from olivevib.files.prints.sheet import sheet_pages
from olivevib.files.prints.svg import svg_text
from olivevib.files.prints.words import in_words
from olivevib.files.prints.writing import write_pages, write_picture

__all__ = [
    "PAPERS_MM",
    "Page",
    "board_page",
    "in_words",
    "marker_modules",
    "marker_picture",
    "marker_text",
    "paper_size",
    "pdf_bytes",
    "sheet_pages",
    "svg_text",
    "write_pages",
    "write_picture",
]
