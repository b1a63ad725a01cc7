"""Motion of the body: estimation, attitude, navigation, what a rest at the start tells of the biases."""
