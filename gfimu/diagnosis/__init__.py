"""Diagnosis: what a simulation gets wrong against measured data, and why."""

from gfimu.diagnosis.diagnose import diagnose
from gfimu.diagnosis.verdict.verdict import Diagnosis

__all__ = ["Diagnosis", "diagnose"]
