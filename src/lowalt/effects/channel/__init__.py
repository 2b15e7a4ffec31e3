"""Effects between the station and the target: paths, visibility, other scatterers, physics beyond Eq. 7."""
