"""Measurements: of speed (``make bench``) and of quality (``make evaluation``)."""
