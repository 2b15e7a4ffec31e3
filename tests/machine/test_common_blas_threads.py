"""One thread for BLAS: within the block alone, however blocks stand in each other, and the bits of
scenes with it.
"""

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from lowalt.machine.blas_threads import one_blas_thread
from lowalt.scene.chain import received_signal
from scenes import A, network, scene, target


def counts() -> set[int]:
    """Threads of every BLAS that is loaded."""
    np.ones((2, 2)) @ np.ones((2, 2))
    return {
        library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"
    }


@pytest.fixture
def two():
    with threadpool_limits(limits=2, user_api="blas"):
        assert counts() == {2}
        yield
        assert counts() == {2}


def test_a_block_has_one_thread_also_where_it_stands_in_another_or_fails(two):
    with one_blas_thread():
        assert counts() == {1}
        with pytest.raises(ZeroDivisionError), one_blas_thread():
            assert counts() == {1}
            raise ZeroDivisionError
        assert counts() == {1}


@pytest.mark.parametrize("effect", ["phase_noise", "clutter", "adc"])
def test_signals_of_scenes_do_not_depend_on_the_number_of_threads(effect):
    """Of arrays so large that a BLAS of two threads would share their products."""
    radio = network(subcarriers=256, symbols=400, transmit=(16, 4), receive=(16, 4))
    cloud, row = target(np.random.default_rng(1), 60, 0.3, x_m=90.0, y_m=40.0, z_m=60.0)
    asked = scene({effect: {}}, radio)
    signals = []
    for threads in (1, 2):
        with threadpool_limits(limits=threads, user_api="blas"):
            signals.append(received_signal(asked, A, cloud, row).signal)
    np.testing.assert_array_equal(*signals)
