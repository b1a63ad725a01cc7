"""The kinds of cases that a campaign can run: an estimate, a drive, a world, a study of the diagnosis."""
