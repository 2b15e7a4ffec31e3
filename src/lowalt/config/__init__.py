"""The configuration: its layers, schema, stations, classes and folds, and the interface of
extensions. No stage is known here.
"""
