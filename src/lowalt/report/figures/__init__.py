"""Figures of the report, one per module: from plain numbers to PNG bytes."""
