"""A free body as nuisance: its specific force, what the gyro does not hold, and the noise that grows with motion."""
