"""The root, in bands, in blocks and whole, against dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import csr_array, diags_array

from gfimu.diagnosis.cholesky import BandFactor, BlockFactor, WholeFactor
from gfimu.diagnosis.drive_root import InverseRoot, banded

SIZE, NARROW, MEDIUM, WIDE, ROWS, MANY_ROWS, RESIDUE = 300, 4, 60, 200, 7, 600, 3


@pytest.fixture(
    params=[
        (NARROW, ROWS, RESIDUE),
        (NARROW, ROWS, 0),
        (NARROW, 0, RESIDUE),
        (NARROW, 0, 0),
        (NARROW, MANY_ROWS, RESIDUE),
        (MEDIUM, ROWS, RESIDUE),
        (MEDIUM, 0, 0),
        (WIDE, ROWS, RESIDUE),
        (WIDE, ROWS, 0),
        (WIDE, 0, 0),
    ],
    ids=str,
)
def problem(request):
    """B, Uᵀ, the border, and the dense matrix they make."""
    bands, rows_count, residue_count = request.param
    rng = np.random.default_rng(7)
    root = diags_array(list(rng.standard_normal((bands, SIZE))), offsets=range(bands), shape=(SIZE, SIZE))
    matrix = csr_array(root.T @ root + 5.0 * diags_array(np.ones(SIZE)))
    rows = 0.04 * rng.standard_normal((rows_count, SIZE))
    coupling = rng.standard_normal((SIZE, residue_count))
    information = 60.0 * np.eye(residue_count)
    dense = np.block([[matrix.toarray() - rows.T @ rows, coupling], [coupling.T, information]])
    return matrix, rows, (information, coupling) if residue_count else None, dense


def test_the_root_is_of_the_inverse(problem):
    matrix, rows, border, dense = problem
    root = InverseRoot.of(matrix, rows, border)
    columns = np.random.default_rng(1).standard_normal((len(dense), 5))
    through = root.apply(columns)
    size = len(dense) + (0 if root.whole else len(rows))
    assert through.shape == (size, 5)
    assert_allclose(through.T @ through, columns.T @ np.linalg.solve(dense, columns), rtol=1e-10, atol=1e-12)
    assert_allclose(root.transposed(through), np.linalg.solve(dense, columns), rtol=1e-9, atol=1e-12)
    assert_allclose(root.transposed(root.apply(columns[:, 0])), np.linalg.solve(dense, columns[:, 0]), atol=1e-12)
    assert root.apply(columns[:, :0]).shape == (size, 0)
    assert root.transposed(through[:, :0]).shape == (len(dense), 0)


def test_its_volume_is_that_of_the_determinant(problem):
    matrix, rows, border, dense = problem
    assert_allclose(InverseRoot.of(matrix, rows, border).log_volume(), -0.5 * np.linalg.slogdet(dense)[1], rtol=1e-12)


def test_a_dense_matrix_is_read_from_its_lower_triangle(problem):
    matrix, rows, border, _ = problem
    dense = np.asfortranarray(np.tril(matrix.toarray()))
    volume = InverseRoot.of(matrix, rows, border).log_volume()
    assert_allclose(InverseRoot.of(dense, rows, border).log_volume(), volume, rtol=1e-12)


def test_the_cheapest_form_is_taken(problem):
    matrix, rows, border, _ = problem
    form = {NARROW: BandFactor, MEDIUM: BlockFactor, WIDE: WholeFactor}[len(banded(matrix))]
    if len(rows) == MANY_ROWS:  # more than the drive has numbers
        form = WholeFactor
    assert isinstance(InverseRoot.of(matrix, rows, border).factor, form)


@pytest.mark.parametrize("coupled", [1, SIZE - 1])
def test_what_the_slow_noise_takes_whole_is_refused(coupled):
    matrix = csr_array(
        diags_array([np.ones(SIZE), *[np.full(SIZE - coupled, 0.1)] * 2], offsets=[0, coupled, -coupled])
    )
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        InverseRoot.of(matrix, 1.2 * np.eye(SIZE)[:1])


def test_bands_hold_the_lower_half():
    matrix = np.array([[4.0, 1.0, 0.0], [1.0, 5.0, 2.0], [0.0, 2.0, 6.0]])
    assert_allclose(banded(csr_array(matrix)), [[4.0, 5.0, 6.0], [1.0, 2.0, 0.0]])
