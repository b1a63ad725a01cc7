"""Motion of the body: estimation, attitude, navigation, biases estimated from a rest at the start."""
