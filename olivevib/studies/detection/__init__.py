"""Markers found and measured, beside other libraries: one study a quantity, and all in one."""
