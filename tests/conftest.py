"""Shared fixtures; pins the linear algebra to one thread, because several collapse on few cores."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

# NumPy reads these when it is first imported, which no import above does.
for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

settings.register_profile("gfimu", deadline=None, derandomize=True, max_examples=50)
settings.load_profile("gfimu")

PROJECT_ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def project_root() -> Path:
    """Root of the checkout."""
    return PROJECT_ROOT


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the measured data beside the project; skips the test where it isn't there."""
    folder = PROJECT_ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"measured data not found at {folder}")
    return folder
