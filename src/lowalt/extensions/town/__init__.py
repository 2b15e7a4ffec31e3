"""A town: buildings from a file, and the paths of waves between a station and a target among them."""
