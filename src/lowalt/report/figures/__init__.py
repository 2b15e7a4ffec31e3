"""Figures of the report, one a module: from plain numbers to PNG bytes."""
