"""The configuration: layers, schema, stations, classes, folds, and the interface of extensions.

No stage is known here.
"""
