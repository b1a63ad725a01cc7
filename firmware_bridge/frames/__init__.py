"""What the bytes on the wire mean: frames, commands, checksums, and formats described in files."""
