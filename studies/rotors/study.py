"""Rotors read from signals: `study.py estimates` of a finished run, `study.py made` of signals in closed form."""

import estimates
import made

from lowalt.config.command import dispatch, run

if __name__ == "__main__":
    run(lambda arguments: dispatch("study.py", {"estimates": estimates.main, "made": made.main}, arguments))
