"""The trial folder: what the technician knows, what each stage wrote, what is stale."""
