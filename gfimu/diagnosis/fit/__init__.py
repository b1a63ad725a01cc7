"""The likelihood of stretches with their nuisance parameters integrated out, and the fit of causes by it."""
