"""Study of the diagnosis: fixed lists of hidden worlds, outcomes as lines of JSON, tables and figures from them."""

from sim.study.cases import STUDIES, Case, study_cases
from sim.study.outcome import run_case
from sim.study.report import write_report
from sim.study.runner import run_study

__all__ = ["STUDIES", "Case", "run_case", "run_study", "study_cases", "write_report"]
