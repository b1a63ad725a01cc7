"""Data of a free body: its run with the gyro, and the stretch that a diagnosis explains."""
