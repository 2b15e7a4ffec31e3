"""The workflow's logic as functions: what runs, with which settings and source files.

No data is computed here.
"""
