"""Channels of a stream, watched while it arrives, and the rate filter that leaves the faulty ones out."""
