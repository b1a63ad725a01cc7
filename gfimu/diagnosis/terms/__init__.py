"""What the data are a sum of: drive, causes, slow noise, calibration residue, each with columns and a prior."""
