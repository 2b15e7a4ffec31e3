"""The configuration: its layers, schema, stations, classes, folds and plan of samples. No stage is
known here.
"""
