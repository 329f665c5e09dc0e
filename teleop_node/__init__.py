"""Teaching by driving: keys and services that drive, record, keep, redo and try."""
