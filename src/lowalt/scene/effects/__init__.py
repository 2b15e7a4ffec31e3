"""One file an effect, in the folder of the place where it acts."""
