"""The page that links all runs and compares any two of them."""

import json

from lowalt.report.page import assembled, templates


def _text(value: object) -> str:
    """A configuration value as text, equal for equal values; JSON has no number for infinity."""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    return value if isinstance(value, str) else json.dumps(value, sort_keys=True)


def overview(name: str, facts: dict[str, dict], page: str | None) -> dict:
    """Return a run's row of the table of runs.

    name: of its folder; facts: {"configuration", "accuracy_percent", "processor_s", "data"} as
    `lowalt compare` reads them; page: address of its report, None where it has none.
    """
    accuracy = facts["accuracy_percent"]
    sizes = facts["data"]
    best: dict[str, tuple[float, str]] = {}
    for key, value in accuracy.items():
        protocol, _, scheme = key.partition(" ")
        best[protocol] = max(best.get(protocol, (value, scheme)), (value, scheme))
    return {
        "name": name,
        "page": page,
        "samples": sizes.get("samples", ""),
        "gigabytes": f"{sizes['bytes'] / 1e9:.3f}" if "bytes" in sizes else "",
        "best": {protocol: f"{value:.2f} ({scheme})" for protocol, (value, scheme) in best.items()},
        "processor_s": f"{sum(facts['processor_s'].values()):.0f}" if facts["processor_s"] else "",
    }


def all_runs(runs: dict[str, dict[str, dict]], pages: dict[str, str]) -> str:
    """Return the page of runs: a table, and a comparison of two that the reader picks.

    runs: facts of each run by the name of its folder, as in `overview`; pages: addresses of their
    reports.
    """
    rows = [overview(name, facts, pages.get(name)) for name, facts in runs.items()]
    data = {}
    for name, facts in runs.items():
        configuration = {key: _text(value) for key, value in facts["configuration"].items()}
        data[name] = {**facts, "configuration": configuration}
    html = templates().get_template("all_runs.html").render(rows=rows, data=data)
    runs_html, _, compare_html = html.partition("<!-- compare -->")
    parts = [
        {"id": "runs", "title": "Runs", "html": runs_html},
        {"id": "compare", "title": "Two runs", "html": compare_html},
    ]
    return assembled("runs", parts)
