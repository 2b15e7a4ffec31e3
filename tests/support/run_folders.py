"""A run's folder with the few files that comparisons of runs read."""

import json


def run_folder(path, accuracy, seconds, **changes):
    """Write a run of one accuracy (percent) and one time of the echo (s); changes: of its
    configuration.
    """
    path.mkdir()
    (path / "config.yaml").write_text(
        json.dumps({"run": path.name, "seed": 1, "motion": {"models": 3}} | changes)
    )
    (path / "accuracy.csv").write_text(
        "protocol,scheme,snr_db,accuracy_percent\n"
        # The average weighs samples, so it need not be the mean of the rows.
        + "".join(
            f"seen,A:VT,{snr},{accuracy + more}\n" for snr, more in ((0, 0), (8, 9), ("avg", 1))
        )
    )
    (path / "stages.csv").write_text(f"rule,cpu_s\necho,{seconds}\n")
    return path
