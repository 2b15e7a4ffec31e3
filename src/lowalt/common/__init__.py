"""Shared by every stage: configuration, files, errors, random streams, stations. No stage is known here."""
