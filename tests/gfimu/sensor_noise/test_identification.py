"""What is no noise is refused by the identification of noise terms."""

import numpy as np
import pytest

from gfimu import InputError, identify_noise


def test_a_smooth_motion_is_no_noise():
    t = np.arange(300) / 100.0
    with pytest.raises(InputError, match="too smoothly"):
        identify_noise(9.7 + 0.5 * np.sin(3 * t), 100.0)
