"""Motion of the body: estimation, attitude, navigation, what a rest at the start shows of the biases."""
