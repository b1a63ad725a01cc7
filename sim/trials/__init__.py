"""Trials: many worlds drawn, run, judged and tabulated.

In: plans of campaigns, lists of cases.
Out: tables of outcomes: of campaigns (`sweep`), of the diagnosis (`study`), of any method that names what a simulation
gets wrong (`benchmark`); `worlds` draws.
"""
