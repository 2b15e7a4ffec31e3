"""Command lines of this package's programs, written as keywords."""


def words(*first: str, **options: object) -> list[str]:
    """Return a command line: the words `first`, then each option with its value or its list of
    values.
    """
    line = list(first)
    for name, value in options.items():
        values = value if isinstance(value, (list, tuple)) else [value]
        line += [f"--{name}", *map(str, values)]
    return line
