"""Synthetic triads with a known truth, and the real recording."""

import numpy as np
import pytest

from gfimu.calibration import ErrorModel


@pytest.fixture
def mti():
    """Coefficients of the Chinese calibration paper's table 1 (fine stage): counts = B + S a + E a."""
    misalignment = [[0, 1.959567, -1.561722], [-1.274475, 0, 0.278138], [5.723103, 9.353853, 0]]
    return ErrorModel.from_counts(
        [33086.641274, 33390.333418, 32648.679799], [409.675030, 411.752659, 412.014478], misalignment
    )


@pytest.fixture
def triad():
    """Triad in m/s² with percent errors."""
    sensitivity = [[1.012, 0.003, -0.006], [0.004, 0.985, 0.002], [-0.005, 0.007, 1.007]]
    return ErrorModel(np.array(sensitivity), np.array([0.31, -0.22, 0.45]))


@pytest.fixture
def xsens_file(shared_data):
    return shared_data / "xsens" / "xsens_acc.txt.gz"
