"""Lower bounds on the error of the angular rate: of one sample (`sample`), over a run (`posterior`)."""
