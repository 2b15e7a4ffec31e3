"""The figure of the time that each rule's jobs took."""

from matplotlib import pyplot as plt

from lowalt.report.figures.style import png


def stage_bars(times: list[dict]) -> bytes:
    """Draw the seconds of each rule's jobs, summed; `times` as `tables.stage_times` gives them."""
    figure, panel = plt.subplots(figsize=(7, 0.32 * len(times) + 0.8))
    names = [f"{entry['rule']} ({entry['jobs']})" for entry in times][::-1]
    seconds = [entry["wall_s"] for entry in times][::-1]
    panel.barh(names, seconds)
    panel.bar_label(panel.containers[0], fmt="%.0f s", padding=3)
    panel.set(xlabel="job seconds, summed over jobs (number of jobs in brackets)")
    panel.margins(x=0.12)
    return png(figure)
