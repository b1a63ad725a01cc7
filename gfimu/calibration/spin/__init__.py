"""The turntable as a centrifuge: K2 and K3 of the sensing axes from plateaus of constant rate (IEEE Std 836)."""

from gfimu.calibration.spin.fit import spin
from gfimu.calibration.spin.policy import SpinPolicy

__all__ = ["SpinPolicy", "spin"]
