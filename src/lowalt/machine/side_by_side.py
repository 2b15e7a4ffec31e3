"""Runs independent calls in parallel, each in its own process."""

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_all_start_methods, get_context
from typing import Any

from lowalt.files.errors import InputError, SpaceError
from lowalt.machine.run_pipe import end_with_starter


def together(calls: Sequence[Callable[[], Any]], jobs: int, start: str = "fork") -> list[Any]:
    """Return what every call returns, in their order, `jobs` of them at a time.

    Calls and results are pickled. One job makes the calls in this process, one after the other.
    start: "fork" inherits the imported modules, which take seconds to import; "spawn" is for calls
    that use torch.
    Raises: what the first call that fails raises, after the calls that had begun; InputError for
    fewer than one job; SpaceError where a process was killed.
    """
    if jobs < 1:
        raise InputError(f"jobs: {jobs}, expected 1 or more")
    if jobs == 1 or start not in get_all_start_methods():
        return [call() for call in calls]
    count = min(jobs, max(len(calls), 1))
    with ProcessPoolExecutor(count, get_context(start), end_with_starter) as pool:
        begun = [pool.submit(call) for call in calls]
        try:
            return [future.result() for future in begun]
        except BrokenProcessPool as error:
            raise SpaceError(
                "a process was killed before it had its result, for lack of memory perhaps"
            ) from error
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
