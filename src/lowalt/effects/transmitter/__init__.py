"""Effects on what a station sends: data, amplifier, pilots, and the instants of the symbols."""
