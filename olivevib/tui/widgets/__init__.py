"""Widgets that show frozen values; none of them reads a file."""
