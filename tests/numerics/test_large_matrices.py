"""Large matrices in a written order: against small ones, NumPy and exact integrals.

NumPy's are its decompositions, the small ones' their sums.
"""

import numpy as np
import pytest

from lowalt.numerics import portable
from lowalt.numerics.chebyshev_series import band_tables, interpolation, over_band
from lowalt.numerics.large_matrices import matrix_product, principal_axes, upper_root
from lowalt.numerics.quadrature import gauss_legendre

RNG = np.random.default_rng(7)


@pytest.mark.parametrize("shape", [(1, 1, 1), (3, 2, 5), (7, 5, 4), (40, 64, 33), (2, 9, 257)])
def test_a_product_has_the_bits_of_the_one_of_small_matrices(shape):
    rows, inner, columns = shape
    a = RNG.standard_normal((rows, inner))
    b = RNG.standard_normal((inner, columns))
    np.testing.assert_array_equal(matrix_product(a, b), portable.product(a, b))
    np.testing.assert_array_equal(matrix_product(b.T, a.T), portable.product(b.T, a.T))


def test_a_triangular_root_is_cholesky_s_and_a_matrix_without_one_is_refused():
    parts = RNG.standard_normal((30, 50))
    covariance = parts @ parts.T
    np.testing.assert_allclose(
        upper_root(covariance), np.linalg.cholesky(covariance).T, rtol=0, atol=1e-12
    )
    with pytest.raises(ValueError, match="not positive definite"):
        upper_root(covariance - 60 * np.eye(30))


def test_principal_axes_are_numpy_s_eigenvectors_over_fifteen_orders_of_magnitude():
    turned = np.linalg.qr(RNG.standard_normal((50, 50)))[0]
    power = 10.0 ** -np.arange(0, 15, 0.5)
    found, axes = principal_axes(turned[:, :30] * np.sqrt(power))
    order = np.argsort(-found)
    np.testing.assert_allclose(found[order], power, rtol=1e-12)
    np.testing.assert_allclose(abs((axes[:, order] * turned[:, :30]).sum(axis=0)), 1.0, rtol=1e-12)
    np.testing.assert_allclose(axes.T @ axes, np.eye(30), atol=1e-14)
    assert (principal_axes(np.zeros((4, 2)))[1] == 0).all()


@pytest.mark.parametrize("count", [1, 2, 3, 6, 33, 120])
def test_gauss_and_legendre_s_rule_is_numpy_s(count):
    node, weight = gauss_legendre(count)
    there = np.polynomial.legendre.leggauss(count)
    np.testing.assert_allclose(node, there[0], rtol=0, atol=4e-16)
    np.testing.assert_allclose(weight, there[1], rtol=1e-10)
    # Exact for polynomials below degree 2 n.
    for degree in range(0, min(2 * count, 40), 2):
        assert float(portable.total(weight * node**degree)) == pytest.approx(
            2 / (degree + 1), rel=1e-13
        )


@pytest.mark.parametrize(("nodes", "spread"), [(1, 0.02), (1, 2.0), (7, 0.1), (1, 64.0)])
def test_tables_of_a_band_give_the_waves_that_they_stand_for(nodes, spread):
    """Moments of single points at places u, against exp(-j 2 pi spread x u / 2) itself.

    They are compared at every subcarrier.
    """
    count = 64
    u = np.linspace(-1, 1, 9)
    tables = band_tables(nodes, spread, count, 1e-11)
    orders = len(tables[0]) // (2 * nodes)
    terms = np.polynomial.chebyshev.chebvander(u, orders - 1)
    moments = np.zeros((len(u), nodes, 2, orders))
    moments[:, :, 0] = terms[:, None]
    found = over_band(moments.reshape(len(u), -1), tables)
    x = (2 * np.arange(count) - count + 1) / count
    exact = np.exp(-1j * np.pi * spread * x * u[:, None])
    np.testing.assert_allclose(found[:, 0] + 1j * found[:, 1], exact, rtol=0, atol=2e-11)
    moments[:, :, 1] = moments[:, :, 0]
    moments[:, :, 0] = 0.0
    found = over_band(moments.reshape(len(u), -1), tables)
    np.testing.assert_allclose(found[:, 0] + 1j * found[:, 1], 1j * exact, rtol=0, atol=2e-11)


def test_interpolation_is_exact_for_polynomials():
    at = np.linspace(-1, 1, 21)
    nodes = np.cos(np.pi * (np.arange(6) + 0.5) / 6)
    weights = interpolation(6, at)
    np.testing.assert_allclose(nodes**5 @ weights, at**5, atol=1e-14)
    np.testing.assert_allclose(np.ones(6) @ weights, 1.0, atol=1e-14)
