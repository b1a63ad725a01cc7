"""What the columns of an unknown file seem to be: times, triads of acceleration and rate, units, chips."""
