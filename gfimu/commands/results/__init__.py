"""What each command prints with --json, as structs: `gfimu.schema` makes the JSON schemas from them."""
