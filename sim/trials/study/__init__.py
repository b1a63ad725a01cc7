"""Study of the diagnosis: fixed lists of hidden worlds, run as a campaign; tables and figures of the outcomes."""
