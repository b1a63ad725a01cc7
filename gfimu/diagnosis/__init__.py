"""Diagnosis: what a simulation gets wrong against measured data, and why.

In: recordings and a world model.
Out: `Diagnosis`: named causes with size and probability, what stays unexplained, the gain, an extended model.
Rooms, each of which imports itself and those before it: `data`, `terms`, `fit`, `search`, `criticism`, `verdict`,
`report`, `design`. Above them stand `diagnose`, the verb, and `one_library`, its steps with one library of effects.
"""

from gfimu.diagnosis.diagnose import diagnose
from gfimu.diagnosis.verdict.verdict import Diagnosis

__all__ = ["Diagnosis", "diagnose"]
