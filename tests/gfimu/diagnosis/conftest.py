"""Makes the helpers of this folder importable from the tests of the rooms below it."""
