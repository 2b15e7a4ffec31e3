"""One thread for BLAS: within the block alone, however blocks stand in each other, and the bits of
scenes with it.
"""

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from emulation import run
from lowalt.machine.blas_threads import one_blas_thread


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


PROBE = """
import hashlib, sys
sys.path.insert(0, "tests/support")
import numpy as np
from scenes import target
from lowalt.config.network import Network, Station
from lowalt.scene.effects import called
from lowalt.scene.chain import received_signal
from lowalt.scene.observe import Scene
from lowalt.motion.table import NUMBERS
station = Station("A", (0.0, 0.0, 25.0), 0.3, 4.9e9)
network = Network(4.9e9, 120e3, 256, 10, 2.5e-3, 400, (16, 4), (16, 4), 1.0, (station,))
cloud, _ = target(np.random.default_rng(1), 60, 0.3)
row = dict.fromkeys(NUMBERS, 0.0) | {"subtype": "Thing", "category": "UAV", "group": "seen", "model": 3}
row |= {"x_m": 90.0, "y_m": 40.0, "z_m": 60.0, "vx_mps": 3.0, "rate_hz": 50.0}
for name in ("phase_noise", "clutter", "adc"):
    scene = Scene(network, 5, None, tuple(called({name: {}})))
    signal = received_signal(scene, station, cloud, row).signal
    print(name, hashlib.sha256(signal.tobytes()).hexdigest())
"""


def test_signals_of_scenes_do_not_depend_on_the_number_of_threads():
    one, other = (run("native", "-c", PROBE, threads=threads) for threads in (1, 2))
    assert one == other and len(set(one.split())) == 6
