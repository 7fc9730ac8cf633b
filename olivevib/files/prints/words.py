"""Numbers in English words: a marker 66 that hangs upside down cannot pass for 99."""

from __future__ import annotations

ONES = (
    *("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine"),
    *("ten", "eleven", "twelve", "thirteen", "fourteen", "fifteen", "sixteen", "seventeen"),
    *("eighteen", "nineteen"),
)
TENS = ("", "", "twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety")


def in_words(number: int) -> str:
    """A whole number from 0 to 999 999 in words: ``two thousand forty-one``."""
    if number >= 1000:
        return _joined(in_words(number // 1000) + " thousand", " ", number % 1000)
    if number >= 100:
        return _joined(ONES[number // 100] + " hundred", " ", number % 100)
    if number >= 20:
        return _joined(TENS[number // 10], "-", number % 10)
    return ONES[number]


def _joined(head: str, glue: str, rest: int) -> str:
    return head + glue + in_words(rest) if rest else head
