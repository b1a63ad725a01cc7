"""The same arithmetic on every x86-64 machine, as stored figures and symmetric ties depend on the order of sums.

OpenBLAS and NumPy choose their instructions by the processor. Here they take those that all such processors since 2013
have, and one thread of linear algebra, as more collapse on few processors.
"""

import os
import platform

__all__ = ["set_arithmetic"]


def set_arithmetic() -> None:
    """Set what OpenBLAS and NumPy read when they are first imported, here and in every process that is started."""
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    if platform.machine().lower() in {"x86_64", "amd64"}:
        os.environ.setdefault("OPENBLAS_CORETYPE", "Haswell")
        os.environ.setdefault("NPY_DISABLE_CPU_FEATURES", "X86_V4 AVX512_ICL AVX512_SPR")
