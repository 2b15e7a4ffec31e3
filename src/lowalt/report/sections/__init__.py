"""Sections of the report, one per module: from tables to the values that the page shows."""
