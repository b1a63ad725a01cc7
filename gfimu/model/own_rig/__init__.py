"""A simulation of one's own as a world model: a function that predicts readings, and what it may have wrong."""

from gfimu.model.own_rig.cause import Cause, Parameter, bias_cause, gain_cause
from gfimu.model.own_rig.model_file import load_model
from gfimu.model.own_rig.simulator import SimulatorModel

__all__ = ["Cause", "Parameter", "SimulatorModel", "bias_cause", "gain_cause", "load_model"]
