"""The one door to what is not ours: files are opened with care, text is escaped."""
