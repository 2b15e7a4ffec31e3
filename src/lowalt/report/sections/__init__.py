"""Sections of the report, one a module: from tables to the values that the page shows."""
