"""Measuring the recorder: cameras, long runs, kills, damage, a lamp."""
