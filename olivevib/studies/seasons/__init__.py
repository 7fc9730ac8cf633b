"""Reports, exports and batches in figures: time, size, memory, resuming, equal results."""
