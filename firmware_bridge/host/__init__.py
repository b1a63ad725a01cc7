"""The computer at the other end: finding a board, recording its stream, its clock, its chips' self-test."""
