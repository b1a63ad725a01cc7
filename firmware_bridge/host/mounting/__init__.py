"""Which array is on the board, and whether what it sent fits that array."""
