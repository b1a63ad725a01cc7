"""Terms: everything unknown, how it shows in the observations, and its prior."""
