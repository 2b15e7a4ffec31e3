"""What every stage shares: configuration, files, errors, random streams, stations. No stage is known here."""
