"""Coded planar markers: the layout of location bars and code area, and libraries of codes."""

from olivevib.marker.distances import (
    CloseCodes,
    LibraryCheck,
    check_library,
    false_match_probability,
)
from olivevib.marker.generation import generate_library
from olivevib.marker.layout import MarkerLayout, MarkerLibrary
from olivevib.marker.loading import load_library, shipped_libraries, shipped_text
from olivevib.marker.text import library_text, parse_library

__all__ = [
    "CloseCodes",
    "LibraryCheck",
    "MarkerLayout",
    "MarkerLibrary",
    "check_library",
    "false_match_probability",
    "generate_library",
    "library_text",
    "load_library",
    "parse_library",
    "shipped_libraries",
    "shipped_text",
]
