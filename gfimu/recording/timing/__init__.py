"""When what a row holds was measured: conversions of the chips, samples of the reference."""
