"""Command lines of this package's programs, written as keywords."""


def words(*first: str, **options: object) -> list[str]:
    """Return a command line: the words `first`, then each option with its value or its list of
    values; an option of None is left out.
    """
    line = list(first)
    for name, value in options.items():
        if value is None:
            continue
        values = value if isinstance(value, (list, tuple)) else [value]
        line += [f"--{name}", *map(str, values)]
    return line
