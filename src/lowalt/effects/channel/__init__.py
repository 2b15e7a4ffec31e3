"""Effects between the station and the target: routes, visibility, other scatterers, physics beyond Eq. 7."""
