"""The border to other people's parsers: whatever they raise becomes an error for people."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

from olivevib.errors import InputError, OlivevibError


@contextmanager
def foreign_parser(source: str, format: str) -> Iterator[None]:
    """Turn any failure of a foreign parser on a damaged file into InputError; hush its warnings.

    A parser for a binary format may raise anything on damaged bytes; the cause is kept.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except OlivevibError:
        raise
    except Exception as error:
        raise InputError(
            f"{source} cannot be read as {format}.",
            f"It is damaged or cut off ({type(error).__name__}: {str(error)[:200]}).",
            "Copy it again from the logger, or export it as CSV.",
        ) from error
