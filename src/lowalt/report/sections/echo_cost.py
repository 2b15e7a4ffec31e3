"""Section: the echo's accuracy over its time, a row a method and tolerance, from the two measured tables."""

from lowalt.report.figures import cost_plots
from lowalt.report.run import ReportedRun

MEASURED = ("method", "points", "range_m", "tolerance", "seconds", "relative_error", "hardware")
PIXELS = ("tolerance", "pixels", "changed_pixels")


def summary(measured: list[dict[str, str]], pixels: list[dict[str, str]]) -> dict:
    """Return {"hardware", "range_m", "samples", "rows"} of the tables' rows (keys MEASURED and PIXELS, text).

    A row: method, tolerance, mean seconds over the samples at the middle distance that all methods were timed at, how
    often FINUFFT and the direct sum take that long (None without them), largest error and changed pixels over all.
    """
    whole: set[str] = {row["range_m"] for row in measured}
    for method in {row["method"] for row in measured}:
        whole &= {row["range_m"] for row in measured if row["method"] == method}
    if not whole:
        return {"hardware": "", "range_m": 0.0, "samples": 0, "rows": []}
    distance = sorted(whole, key=float)[len(whole) // 2]
    times: dict[tuple[str, str], list[float]] = {}
    errors: dict[tuple[str, str], float] = {}
    for row in measured:
        key = row["method"], row["tolerance"]
        errors[key] = max(errors.get(key, 0.0), float(row["relative_error"]))
        if row["range_m"] == distance:
            times.setdefault(key, []).append(float(row["seconds"]))
    changed: dict[float, list[int]] = {}
    for row in pixels:
        total = changed.setdefault(float(row["tolerance"]), [0, 0])
        total[0] += int(row["changed_pixels"])
        total[1] += int(row["pixels"])
    mean = {key: sum(spent) / len(spent) for key, spent in times.items()}
    peers = {name: next((mean[key] for key in mean if key[0].startswith(name)), None) for name in ("FINUFFT", "direct")}
    rows = []
    for key, seconds in mean.items():
        method, tolerance = key
        engine = method == "engine" and tolerance != "exact"
        rows.append({
            "method": method, "tolerance": tolerance, "seconds": seconds, "error": errors[key],
            "over_finufft": peers["FINUFFT"] and peers["FINUFFT"] / seconds,
            "over_direct": peers["direct"] and peers["direct"] / seconds,
            "pixels": changed.get(float(tolerance)) if engine else None,
        })  # fmt: skip
    samples = max(len(spent) for spent in times.values())
    return {"hardware": measured[0]["hardware"], "range_m": float(distance), "samples": samples, "rows": rows}


def sentence(rows: list[dict]) -> str:
    """Return what a tolerance saves, in a sentence; "" where the exact mode or tolerances were not timed."""
    engine = {row["tolerance"]: row["seconds"] for row in rows if row["method"] == "engine"}
    exact, others = engine.get("exact"), [seconds for tolerance, seconds in engine.items() if tolerance != "exact"]
    if exact is None or not others:
        return ""
    saved = exact - min(others)
    words = f"The exact mode costs {1e3 * exact:.2f} ms a signal; "
    if saved <= 0.2 * exact:
        return words + f"no tolerance saves more than {1e3 * max(saved, 0.0):.2f} ms, so use the exact one."
    return words + f"the loosest tolerance saves {1e3 * saved:.2f} ms of it."


def values(run: ReportedRun) -> dict | None:
    """Return the short table, its plot and what it says; None where neither run nor reference has them."""
    name = run.inputs.own_or_kept("echo_cost")
    if name is None:
        return None
    own = name == "echo_cost"
    changed = "echo_pixels" if own else "kept_echo_pixels"
    measured = run.inputs.table(name, *MEASURED, "category")
    cost = summary(measured, run.inputs.table(changed, *PIXELS))
    return {"own": own, "cost": cost, "plot": cost_plots.echo(measured), "sentence": sentence(cost["rows"])}
