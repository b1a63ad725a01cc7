"""When what a row holds was measured."""
