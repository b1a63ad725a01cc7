"""Warnings of MuJoCo as warnings of Python: by itself it writes them to a file in the current folder."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

from gfimu.base.errors import warn

__all__ = ["mujoco_warnings"]


@contextmanager
def mujoco_warnings(source: str = "simulation") -> Iterator[None]:
    """Give what MuJoCo warns of within as `RecordingWarning`, each text once; nothing is written to ``MUJOCO_LOG.TXT``.

    Parameters
    ----------
    source : str
        What it is about, in front of the text.
    """
    before, texts = mujoco.get_mju_user_warning(), list[str]()
    mujoco.set_mju_user_warning(texts.append)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
        for text in dict.fromkeys(" ".join(one.split()) for one in texts):
            warn(f"{source}: {text}")
